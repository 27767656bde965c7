#pragma once
// Memory that a file does not justify, caught where it is asked for.

#include <cstddef>

namespace photosphere::fuzz {

/// While one lives, operator new refuses what is larger than `bytes` (std::bad_alloc) on any thread
/// and remembers that it was asked. One at a time. Does nothing under a sanitizer, whose allocator
/// is not to be replaced.
class AllocationLimit {
 public:
  explicit AllocationLimit(std::size_t bytes);
  ~AllocationLimit();
  AllocationLimit(const AllocationLimit&) = delete;
  AllocationLimit& operator=(const AllocationLimit&) = delete;
  /// Largest request above the limit; 0 when there was none.
  std::size_t refused() const;
};

}  // namespace photosphere::fuzz
