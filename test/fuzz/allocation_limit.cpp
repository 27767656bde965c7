#include "allocation_limit.h"

#include <malloc.h>

#include <algorithm>
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
std::atomic<std::ptrdiff_t> g_held{0};  ///< since the limit began

}  // namespace

AllocationLimit::AllocationLimit(std::size_t bytes) {
  g_refused = 0;
  g_held = 0;
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
  const std::size_t limit = g_limit;
  const auto held = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, g_held));
  if (size > limit || (limit != kNone && held + size > 2 * limit)) {
    if (size > g_refused) g_refused = size;
    throw std::bad_alloc();
  }
  void* memory = std::malloc(size > 0 ? size : 1);
  if (!memory) throw std::bad_alloc();
  g_held += static_cast<std::ptrdiff_t>(malloc_usable_size(memory));
  return memory;
}

void limitedRelease(void* memory) {
  if (memory) g_held -= static_cast<std::ptrdiff_t>(malloc_usable_size(memory));
  std::free(memory);
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
  photosphere::fuzz::limitedRelease(memory);
}
void operator delete[](void* memory) noexcept {
  photosphere::fuzz::limitedRelease(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  photosphere::fuzz::limitedRelease(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  photosphere::fuzz::limitedRelease(memory);
}
#endif
