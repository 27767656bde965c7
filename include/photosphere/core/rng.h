#pragma once
// Counter-based random numbers: each value is a function of (seed, frame, stream, index,
// dimension), so work can be split over threads, shards and restarts without changing one bit.

#include <Random123/philox.h>

#include <cstdint>

#include "photosphere/core/types.h"

namespace photosphere {

/// What a random sequence is for. Streams of one seed are independent of one another.
enum class RandomStream : std::uint32_t {
  photon = 1,
  rounding = 2,
  camera = 3,
  particles = 4,
  merge = 5,
  importance = 6,
  visibility = 7,
  connection = 8,
  test = 99,
};

/// The key of all random numbers of a frame.
struct RandomKey {
  std::uint32_t lo = 0;
  std::uint32_t hi = 0;

  /// @param frame  0 when the noise pattern is to stay still over a sequence
  static RandomKey fromSeed(std::uint64_t seed, std::int64_t frame) {
    // Two rounds of splitmix64 (Steele et al. 2014) spread neighbouring seeds and frames.
    auto mix = [](std::uint64_t z) {
      z += 0x9e3779b97f4a7c15ull;
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
      z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
      return z ^ (z >> 31);
    };
    const std::uint64_t k = mix(mix(seed) ^ static_cast<std::uint64_t>(frame));
    return {static_cast<std::uint32_t>(k), static_cast<std::uint32_t>(k >> 32)};
  }
};

/// Philox4x32-10 sequence of one index (a photon, a camera sample). Cheap to construct.
class Rng {
 public:
  Rng(RandomKey key, RandomStream stream, std::uint64_t index)
      : m_counter{{0, static_cast<std::uint32_t>(stream), static_cast<std::uint32_t>(index),
                   static_cast<std::uint32_t>(index >> 32)}},
        m_key{{key.lo, key.hi}} {}

  /// 32 random bits.
  std::uint32_t bits() {
    if (m_used == 4) {
      m_block = r123::Philox4x32()(m_counter, m_key);
      ++m_counter[0];
      m_used = 0;
    }
    return m_block[m_used++];
  }

  /// Uniform in [0, 1), 24 bits.
  float uniform() { return static_cast<float>(bits() >> 8) * 0x1p-24f; }

  /// Uniform in (0, 1], with full relative precision near 0: the argument of a logarithm.
  float uniformPositive() { return (static_cast<float>(bits()) + 0.5f) * 0x1p-32f; }

  /// Uniform in [0, 1), 32 bits, for choices with small probabilities.
  double uniformDouble() { return static_cast<double>(bits()) * 0x1p-32; }

  Vec2f uniform2() {
    const float x = uniform();
    return {x, uniform()};
  }

 private:
  r123::Philox4x32::ctr_type m_counter;
  r123::Philox4x32::key_type m_key;
  r123::Philox4x32::ctr_type m_block{};
  unsigned m_used = 4;
};

}  // namespace photosphere
