#pragma once
// Memory that a file does not justify, caught where it is asked for.

#include <cstddef>

namespace photosphere::fuzz {

/// While one lives, operator new refuses on any thread what is larger than `bytes`
/// (std::bad_alloc), or would hold more than twice that in all, and remembers that it was asked.
/// One at a time. Does nothing under a sanitizer, whose allocator is not to be replaced.
class AllocationLimit {
 public:
  explicit AllocationLimit(std::size_t bytes);
  ~AllocationLimit();
  AllocationLimit(const AllocationLimit&) = delete;
  AllocationLimit& operator=(const AllocationLimit&) = delete;
  /// Largest request that was refused; 0 when there was none.
  std::size_t refused() const;
};

}  // namespace photosphere::fuzz
