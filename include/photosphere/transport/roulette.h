#pragma once
// Roulette: light of which little is left ends by chance, or goes on as more; the mean stays.

#include "photosphere/core/rng.h"
#include "photosphere/core/types.h"

namespace photosphere::transport {

/// Part of light below which it plays.
inline constexpr float kRouletteFrom = 0.1f;

/// Roulette over light of which less than a tenth is left: its factor, which is 0 where the ray
/// ends dark and whose mean is 1. Survival is in proportion to what is left.
inline float roulette(float left, Rng& rng) {
  if (!(left < kRouletteFrom)) return 1.0f;
  return left > 1e-30f && rng.uniform() * kRouletteFrom < left ? kRouletteFrom / left : 0.0f;
}

/// The same over channels of which next to nothing is left beside the largest, so that they do not
/// keep a walk at the pace of their extinction: the factor of each, whose mean is 1.
inline Rgb rouletteOfFaint(const Rgb& light, Rng& rng) {
  const float largest = maxComponent(light), least = 0x1p-10f * largest;
  Rgb factor(1.0f);
  for (int channel = 0; channel < 3; ++channel) {
    const float own = light[channel];
    if (!(own > 0.0f && own < least)) continue;
    const bool stays = own > 1e-30f * largest && rng.uniform() * least < own;
    factor[channel] = stays ? least / own : 0.0f;
  }
  return factor;
}

}  // namespace photosphere::transport
