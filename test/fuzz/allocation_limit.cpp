#include "allocation_limit.h"

#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>

#include "support/support.h"

namespace photosphere::fuzz {

namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
std::atomic<std::size_t> g_limit{kNone};
std::atomic<std::size_t> g_refused{0};

}  // namespace

AllocationLimit::AllocationLimit(std::size_t bytes) {
  g_refused = 0;
  g_limit = bytes;
}

AllocationLimit::~AllocationLimit() {
  g_limit = kNone;
}

std::size_t AllocationLimit::refused() const {
  return g_refused;
}

/// What replaced operator new does.
void* limitedAllocation(std::size_t size) {
  if (size > g_limit) {
    if (size > g_refused) g_refused = size;
    throw std::bad_alloc();
  }
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}

}  // namespace photosphere::fuzz

#if !defined(PHOTOSPHERE_SANITIZED)
void* operator new(std::size_t size) {
  return photosphere::fuzz::limitedAllocation(size);
}
void* operator new[](std::size_t size) {
  return photosphere::fuzz::limitedAllocation(size);
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}
#endif
