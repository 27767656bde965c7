#pragma once
// 64-bit fixed-point sums (METHOD section 6): integer addition does not depend on order, so the
// same deposits give the same bits for any number of threads, shards or restarts.

#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <thread>
#include <vector>

#include "photosphere/core/rng.h"

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
  // As -quantize(-value, ...) below zero, without asking which: the signs of harmonics are anyone's
  // guess.
  const double scaled = value * inverseQuantum;
  const auto whole = static_cast<std::int64_t>(scaled);
  const double fraction = std::abs(scaled - static_cast<double>(whole));
  const std::int64_t away = fraction > static_cast<double>(bits) * 0x1p-32 ? 1 : 0;
  return whole + (scaled < 0 ? -away : away);
}

/// Adds to a sum that other threads may add to at the same time.
/// @return false when the sum left the range of 63 bits (the caller counts it and fails the work)
inline bool addChecked(std::int64_t& sum, std::int64_t value) {
  const std::int64_t before =
      std::atomic_ref<std::int64_t>(sum).fetch_add(value, std::memory_order_relaxed);
  std::int64_t unused;
  return !__builtin_add_overflow(before, value, &unused);
}

/// A number of a deposit's own coordinates: photon, flight and number within the flight (murmur3's
/// finaliser).
inline std::uint64_t depositHash(RandomKey key, std::uint64_t photon, std::uint32_t flight,
                                 std::uint32_t deposit) {
  std::uint64_t h = photon * 0x9e3779b97f4a7c15ull ^
                    (static_cast<std::uint64_t>(flight) << 32 | deposit) ^
                    (static_cast<std::uint64_t>(key.hi) << 32 | key.lo);
  h ^= h >> 33;
  h *= 0xff51afd7ed558ccdull;
  h ^= h >> 33;
  h *= 0xc4ceb9fe1a85ec53ull;
  return h;
}

/// 32 bits of the same: a hash is enough where they only decide the direction of rounding.
inline std::uint32_t roundingBits(RandomKey key, std::uint64_t photon, std::uint32_t flight,
                                  std::uint32_t deposit) {
  return static_cast<std::uint32_t>(depositHash(key, photon, flight, deposit) >> 32);
}

/// Integer sums and the worth of one unit. Many threads may add at once, to one sum either by `add`
/// and `addSigned` or by `addRow`.
struct FixedSums {
  std::vector<std::int64_t> sums;
  double quantum = 1.0;
  std::atomic<std::uint64_t> overflows{0};

  /// Adds value (of the quantum's unit), not negative; `bits` rounds it.
  void add(std::size_t at, double value, std::uint32_t bits) {
    const double units = value / quantum;
    if (units < kMost)
      addWhole(at, quantize(units, 1.0, bits));
    else
      overflows.fetch_add(1, std::memory_order_relaxed);
  }
  /// The same for a value of either sign.
  void addSigned(std::size_t at, double value, std::uint32_t bits) {
    addWhole(at, wholeSigned(value, bits));
  }
  /// What `addSigned` would add: whole units; 0, and counted, where they are too many.
  std::int64_t wholeSigned(double value, std::uint32_t bits) {
    const double units = value / quantum;
    if (std::abs(units) < kMost) return quantizeSigned(units, 1.0, bits);
    overflows.fetch_add(1, std::memory_order_relaxed);
    return 0;
  }
  /// Has the memory of `count` sums come near, while something else is computed.
  void prefetchRow(std::size_t at, std::size_t count) const {
    constexpr std::size_t kLine = 64 / sizeof(std::int64_t);
    for (std::size_t i = 0; i < count; i += kLine)
      __builtin_prefetch(sums.data() + at + i, 1);
  }
  /// Adds whole units to the row of sums that begins at `at`. Rows do not overlap. Their lock costs
  /// what adding one sum alone does.
  void addRow(std::size_t at, std::span<const std::int64_t> whole) {
    std::int64_t* const row = sums.data() + at;
    std::uint64_t lost = 0;
    std::atomic<bool>& taken = lockOf(at);
    for (int tries = 0; taken.exchange(true, std::memory_order_acquire); ++tries)
      if (tries % 64 == 63) std::this_thread::yield();
    for (std::size_t i = 0; i < whole.size(); ++i)
      lost += __builtin_add_overflow(row[i], whole[i], &row[i]) ? 1 : 0;
    taken.store(false, std::memory_order_release);
    if (lost > 0) overflows.fetch_add(lost, std::memory_order_relaxed);
  }

 private:
  static constexpr double kMost = 4e18;
  static constexpr int kLockBits = 14;

  // Rows share locks. Neighbours have theirs far apart, not to wait for one cache line.
  std::atomic<bool>& lockOf(std::size_t at) {
    return m_locks[(static_cast<std::uint64_t>(at) * 0x9e3779b97f4a7c15ull) >> (64 - kLockBits)];
  }
  void addWhole(std::size_t at, std::int64_t whole) {
    if (whole != 0 && !addChecked(sums[at], whole))
      overflows.fetch_add(1, std::memory_order_relaxed);
  }

  std::unique_ptr<std::atomic<bool>[]> m_locks =
      std::make_unique<std::atomic<bool>[]>(std::size_t{1} << kLockBits);
};

}  // namespace photosphere
