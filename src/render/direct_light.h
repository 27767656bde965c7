#pragma once
// Light of lamps that scatters at a point for the first time: next-event estimation with the
// frame's shadows.

#include <memory>
#include <optional>
#include <vector>

#include "lamp_choice.h"
#include "photosphere/core/effects.h"
#include "photosphere/render/integrator.h"
#include "photosphere/render/shadows.h"

namespace photosphere::render {

/// A step of a march.
struct MarchStep {
  const transport::Segment& ray;
  float t0, t1;  ///< along the ray [m]
};

/// Immutable; thread-safe. Holds references to what it is made of.
class DirectLight {
 public:
  /// @param carried  lamps with extent are left to the estimator, which stores their light
  DirectLight(const transport::Medium& medium, const transport::LightList& lights,
              const Shadows& shadows, bool useShadows, bool carried);

  /// The same, shadows used whatever the effects are.
  DirectLight withShadows() const;

  /// Light scattered at `p` toward `wo` [W m^-3 sr^-1]: of every lamp, or, where there are more
  /// than LampChoice::kFew, its unbiased estimate from a few of them. Where `p` is the middle of a
  /// march step, the light of a near lamp is that of a random point of the step in its stead: its
  /// mean over the step is right, however 1/d^2, direction and shadow change within it.
  /// @tparam Light  of transmittances: float, or Rgb where extinction differs from channel to
  ///                channel
  template <class Light, class When>
  Rgb at(const Vec3f& p, const Vec3f& wo, const transport::Coefficients& c, const MarchStep* step,
         Rng& rng, IntegratorCounters& counters, When when) const;

 private:
  template <class Light, class When>
  Rgb of(std::size_t light, const Vec3f& p, const Vec3f& wo, const transport::Coefficients& c,
         const MarchStep* step, Rng& rng, IntegratorCounters& counters, When when) const;

  const transport::Medium& m_medium;
  const transport::LightList& m_lights;
  const Shadows& m_shadows;
  bool m_useShadows;
  std::vector<std::optional<lights::Place>> m_places;  // by light
  std::vector<std::size_t> m_lamps;
  std::shared_ptr<const LampChoice> m_choice;  // of many lamps
};

}  // namespace photosphere::render
