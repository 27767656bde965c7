#pragma once
// One scattering event: roulette by albedo, choice of phase function, new direction.

#include "photosphere/core/rng.h"
#include "photosphere/transport/medium.h"

namespace photosphere::transport {

/// Result of a collision.
struct ScatterEvent {
  bool survived = false;
  Rgb weight{1.0f};  ///< multiplies the power; no channel above 1 for one phase function
  Vec3f direction{0.0f};
  int phase = 0;  ///< index into Medium::phases()
};

/// Russian roulette with the largest albedo of the channels, so that grey media keep equal weights
/// and coloured ones bounded weights; then a phase function in proportion to its scattering.
inline ScatterEvent scatter(const Medium& medium, const Vec3f& point, const Vec3f& wi, Rng& rng) {
  ScatterEvent event;
  const auto& phases = medium.phases();
  if (const Rgb* uniform = medium.uniformAlbedo()) {
    const float q = maxComponent(*uniform);
    if (!(rng.uniform() < q)) return event;
    event.weight = *uniform / q;
  } else {
    Coefficients c;
    medium.coefficients(point, c);
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
