#pragma once
// 64-bit fixed-point sums (METHOD section 6): integer addition does not depend on order, so the
// same deposits give the same bits for any number of threads, shards or restarts.

#include <atomic>
#include <cstdint>

namespace photosphere {

/// Rounds `value / quantum` up or down at random so that its expectation is exact.
/// @param bits  32 random bits from the deposit's own counter
inline std::int64_t quantize(double value, double inverseQuantum, std::uint32_t bits) {
  const double scaled = value * inverseQuantum;
  const double whole = static_cast<double>(static_cast<std::int64_t>(scaled));
  const double fraction = scaled - whole;  // same sign as value, which is never negative here
  return static_cast<std::int64_t>(whole) +
         (fraction > static_cast<double>(bits) * 0x1p-32 ? 1 : 0);
}

/// The same for values of either sign: bins of directions, spherical harmonics.
inline std::int64_t quantizeSigned(double value, double inverseQuantum, std::uint32_t bits) {
  return value < 0 ? -quantize(-value, inverseQuantum, bits)
                   : quantize(value, inverseQuantum, bits);
}

/// Adds to a sum that other threads may add to at the same time.
/// @return false when the sum left the range of 63 bits (the caller counts it and fails the work)
inline bool addChecked(std::int64_t& sum, std::int64_t value) {
  const std::int64_t before =
      std::atomic_ref<std::int64_t>(sum).fetch_add(value, std::memory_order_relaxed);
  std::int64_t unused;
  return !__builtin_add_overflow(before, value, &unused);
}

}  // namespace photosphere
