#pragma once
// Final gathering: the first bounce is path-traced, then the photosphere is looked up.

#include <vector>

#include "direct_light.h"
#include "photosphere/estimators/inscatter.h"
#include "photosphere/render/integrator.h"
#include "photosphere/transport/scatter.h"

namespace photosphere::render {

/// Where along a marched ray light is taken out of it: what first collisions are drawn from.
class RayOpacity {
 public:
  void clear() { m_steps.clear(); }
  /// @param extinction  of several channels, the mean by what the step takes out of each [1/m]
  /// @param opacity     of the ray up to the end of this step, mean of the channels
  /// @param removed     light that this step takes out of each channel
  void add(float t0, float t1, float extinction, float opacity, const Rgb& removed) {
    m_steps.push_back({t0, t1 - t0, extinction, opacity, removed});
  }
  /// Opacity of the whole ray.
  float total() const { return m_steps.empty() ? 0.0f : m_steps.back().opacity; }
  struct Place {
    float distance;  ///< [m]
    float middle;    ///< of the step that it lies in [m]
    Rgb removed;     ///< there, in ratio to the mean of the channels: 1 where they are alike
  };
  /// Drawn in proportion to transmittance times extinction. @param u  in [0, 1)
  Place sample(float u) const;

 private:
  struct Step {
    float begin, length, extinction, opacity;
    Rgb removed;
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
  /// @tparam Light  float, or Rgb where extinction differs from channel to channel
  template <class Light, class When>
  Rgb multiple(const transport::Segment& ray, const RayOpacity& opacity, Rng& rng,
               IntegratorCounters& counters, When when) const;

 private:
  template <class When>
  transport::ScatterEvent scatterAt(const Vec3f& p, const Vec3f& wi, const Rgb& power, Rng& rng,
                                    When when) const;
  template <class Light, class When>
  Rgb arriving(Vec3f p, const Vec3f& d, const Rgb& power, Rng& rng, IntegratorCounters& counters,
               When when) const;

  const transport::Medium& m_medium;
  DirectLight m_direct;
  const estimators::InscatterSource& m_source;
  const transport::Emission* m_emission;
  int m_rays;
};

}  // namespace photosphere::render
