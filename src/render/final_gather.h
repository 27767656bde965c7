#pragma once
// Final gathering: the first bounce is path-traced, then the photosphere is looked up.

#include <vector>

#include "direct_light.h"
#include "photosphere/estimators/inscatter.h"
#include "photosphere/render/integrator.h"

namespace photosphere::render {

/// Where along a marched ray light is taken out of it: what first collisions are drawn from.
class RayOpacity {
 public:
  void clear() { m_steps.clear(); }
  /// @param opacity  of the ray up to the end of this step
  void add(float t0, float t1, float extinction, float opacity) {
    m_steps.push_back({t0, t1 - t0, extinction, opacity});
  }
  /// Opacity of the whole ray.
  float total() const { return m_steps.empty() ? 0.0f : m_steps.back().opacity; }
  /// Distance drawn in proportion to transmittance times extinction. @param u  in [0, 1)
  float sample(float u) const;

 private:
  struct Step {
    float begin, length, extinction, opacity;
  };
  std::vector<Step> m_steps;
};

/// Immutable; thread-safe.
class FinalGather {
 public:
  /// @param rays    secondary rays of each camera ray
  /// @param source  answers toward any direction, and right for any point of the smoke
  FinalGather(const transport::Medium& medium, DirectLight direct,
              const estimators::InscatterSource& source, const Effects& effects, int rays);

  /// Light scattered twice or more, and the smoke's own scattered at least once, along a camera
  /// ray [W m^-2 sr^-1]: at first collisions drawn from its opacity, one direction each is followed
  /// to the next collision, where lamps are seen directly and everything else is looked up.
  Rgb multiple(const transport::Segment& ray, const RayOpacity& opacity, Rng& rng,
               IntegratorCounters& counters) const;

 private:
  Rgb arriving(const Vec3f& p, const Vec3f& d, Rng& rng, IntegratorCounters& counters) const;

  const transport::Medium& m_medium;
  DirectLight m_direct;
  const estimators::InscatterSource& m_source;
  const transport::Emission* m_emission;
  int m_rays;
};

}  // namespace photosphere::render
