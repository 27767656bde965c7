#pragma once
// One scattering event: roulette by albedo, choice of phase function, new direction.

#include "photosphere/core/rng.h"
#include "photosphere/transport/medium.h"
#include "photosphere/transport/roulette.h"

namespace photosphere::transport {

/// Sum over phase functions of sigma_s times the phase [1/(m sr)].
/// @param wi, wo  unit, both along the light's way
inline Rgb scatteringToward(const Medium& medium, const Coefficients& c, const Vec3f& wi,
                            const Vec3f& wo) {
  const auto& phases = medium.phases();
  Rgb sum(0.0f);
  for (std::size_t i = 0; i < phases.size(); ++i)
    sum += c.scattering[i] * phases[i].evaluate(wi, wo);
  return sum;
}

/// Part of the light of a collision that goes toward `wo`: the same over Coefficients::extinction
/// [1/sr]. Of rarer collisions, Collision::share is to divide it.
template <class When = Still>
inline Rgb phaseAlbedo(const Medium& medium, const Vec3f& p, const Vec3f& wi, const Vec3f& wo,
                       When when = {}) {
  if (const Rgb* uniform = medium.uniformAlbedo())
    return *uniform * medium.phases()[0].evaluate(wi, wo);
  Coefficients c;
  medium.coefficients(p, c, when);
  return c.extinction > 0.0f ? scatteringToward(medium, c, wi, wo) / c.extinction : Rgb(0.0f);
}

/// Result of a collision.
struct ScatterEvent {
  bool survived = false;
  /// False: nothing was met and the flight goes on as it was, with another weight. Only where
  /// extinction differs from channel to channel.
  bool scattered = true;
  Rgb weight{1.0f};  ///< multiplies the power; no channel above 1 for one phase function and grey
                     ///< extinction. Where extinction is coloured, the sum of the channels' powers
                     ///< stays what it was
  Vec3f direction{0.0f};
  int phase = 0;  ///< index into Medium::phases()
};

/// What becomes of light of some power where each channel has its own chances: at a collision drawn
/// for the densest channel that carries any it passes, scatters or is absorbed. What happens is
/// drawn for the sum of the channels' powers and each channel weighted by its own chance over that
/// (the balance heuristic over channels, with all of the path so far; Miller, Georgiev and Jarosz
/// 2019, Kutz et al. 2017), so the sum never changes and no channel ever passes it, but for what
/// roulette gives and takes of channels that are next to dark (rouletteOfFaint).
/// @param passes  chance of each channel to meet nothing
/// @param rate    what the scattering coefficients of `c` are divided by: with `passes`, no sum
///                above 1 in any channel
inline ScatterEvent scatterColoured(const Medium& medium, const Coefficients& c, const Rgb& passes,
                                    const Rgb& rate, const Vec3f& wi, const Rgb& power, Rng& rng) {
  ScatterEvent event;
  const float sum = power.x + power.y + power.z;
  if (!(sum > 0.0f)) return event;
  const Rgb share = power / sum;
  float u = rng.uniform();
  const float pass = glm::dot(share, passes);
  if (u < pass) {
    event.survived = true;
    event.scattered = false;
    event.weight = passes / pass;
    event.weight *= rouletteOfFaint(share * event.weight, rng);
    event.direction = wi;
    return event;
  }
  u -= pass;
  const auto& phases = medium.phases();
  for (std::size_t i = 0; i < phases.size(); ++i) {
    Rgb chance(0.0f);
    for (int channel = 0; channel < 3; ++channel)
      if (rate[channel] > 0.0f) chance[channel] = c.scattering[i][channel] / rate[channel];
    const float own = glm::dot(share, chance);
    if (u < own) {
      event.survived = true;
      event.phase = static_cast<int>(i);
      event.weight = chance / own;
      event.direction = phases[i].sample(wi, rng.uniform2());
      return event;
    }
    u -= own;
  }
  return event;
}

/// Chance of each channel to meet nothing at a collision drawn at some rate [1/m], which is no less
/// than the extinction of any that carries light.
inline Rgb passingChance(float rate, const Rgb& channels) {
  return glm::max(Rgb(0.0f), Rgb(1.0f) - channels / rate);
}

/// Russian roulette with the largest albedo of the channels, so that grey media keep equal weights
/// and coloured ones bounded weights; then a phase function in proportion to its scattering.
/// @param power  of the light that arrives, in any unit: acts where extinction is coloured, where
///               collisions are those of `sampleCollisionOf`
template <class When = Still>
inline ScatterEvent scatter(const Medium& medium, const Vec3f& point, const Vec3f& wi,
                            const Rgb& power, Rng& rng, When when = {}) {
  ScatterEvent event;
  const auto& phases = medium.phases();
  if (const Rgb* uniform = medium.uniformAlbedo()) {
    const float q = maxComponent(*uniform);
    if (!(rng.uniform() < q)) return event;
    event.weight = *uniform / q;
  } else {
    Coefficients c;
    medium.coefficients(point, c, when);
    if (medium.isColoured()) {
      if (!(c.extinction > 0.0f)) return event;
      const Rgb channels = medium.channels(point, c.extinction, when);
      const float rate = c.extinction * medium.livingShare(power);
      return scatterColoured(medium, c, passingChance(rate, channels), Rgb(rate), wi, power, rng);
    }
    const int count = static_cast<int>(phases.size());
    const Rgb scattering = c.totalScattering(count);
    const float q =
        c.extinction > 0.0f ? glm::min(1.0f, maxComponent(scattering) / c.extinction) : 0.0f;
    if (!(rng.uniform() < q)) return event;
    event.weight = scattering / maxComponent(scattering);
    if (count > 1) {
      float pick = rng.uniform() * meanComponent(scattering);
      while (event.phase + 1 < count) {
        pick -= meanComponent(c.scattering[static_cast<std::size_t>(event.phase)]);
        if (pick < 0.0f) break;
        ++event.phase;
      }
      const Rgb& chosen = c.scattering[static_cast<std::size_t>(event.phase)];
      const float probability = meanComponent(chosen) / meanComponent(scattering);
      for (int i = 0; i < 3; ++i)
        event.weight[i] *= scattering[i] > 0.0f && probability > 0.0f
                               ? chosen[i] / scattering[i] / probability
                               : 0.0f;
    }
  }
  event.survived = true;
  event.direction = phases[static_cast<std::size_t>(event.phase)].sample(wi, rng.uniform2());
  return event;
}

}  // namespace photosphere::transport
