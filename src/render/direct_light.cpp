#include "direct_light.h"

#include <algorithm>
#include <cmath>

#include "instances.h"
#include "photosphere/transport/scatter.h"

namespace photosphere::render {

namespace {

using transport::Coefficients;
using transport::Medium;

// Mean of 1/d^2 over the step, over its value at the middle: the integral has a closed form (the
// substitution of equiangular sampling), so a lamp inside the smoke costs no subdivision.
float nearLampFactor(const MarchStep& step, const Vec3f& p, const lights::Illumination& in) {
  const Vec3f lamp = p - in.direction * in.distance;
  const float along = glm::dot(lamp - step.ray.origin, step.ray.direction);
  const Vec3f foot = step.ray.origin + step.ray.direction * along;
  const Vec3f across = lamp - foot;
  const float h = std::max(std::sqrt(glm::dot(across, across)), 1e-6f * in.distance + 1e-20f);
  const float angle = std::atan((step.t1 - along) / h) - std::atan((step.t0 - along) / h);
  return angle / (h * (step.t1 - step.t0)) * in.distance * in.distance;
}

}  // namespace

DirectLight::DirectLight(const Medium& medium, const transport::LightList& lights,
                         const Shadows& shadows, bool useShadows, bool carried)
    : m_medium(medium), m_lights(lights), m_shadows(shadows), m_useShadows(useShadows) {
  std::vector<const lights::Light*> lamps;
  for (std::size_t i = 0; i < lights.size(); ++i)
    if (lights[i]->isDelta() || !carried) {
      m_lamps.push_back(i);
      lamps.push_back(lights[i].get());
    }
  if (lamps.size() > LampChoice::kFew) m_choice = std::make_shared<LampChoice>(medium, lamps);
}

DirectLight DirectLight::withShadows() const {
  DirectLight shadowed = *this;
  shadowed.m_useShadows = true;
  return shadowed;
}

// Of one lamp.
template <class Light, class When>
Rgb DirectLight::of(std::size_t i, const Vec3f& p, const Vec3f& wo, const Coefficients& c,
                    const MarchStep* step, Rng& rng, IntegratorCounters& counters,
                    When when) const {
  const lights::Light& light = *m_lights[i];
  const Vec2f u = light.isDelta() ? Vec2f(0.5f) : rng.uniform2();
  lights::Illumination in = light.illuminate(p, u);
  if (!(maxComponent(in.irradiance) > 0.0f)) return Rgb(0.0f);
  if (step && in.distance < 8.0f * (step->t1 - step->t0))
    in.irradiance *= nearLampFactor(*step, p, in);
  const Light visible = m_useShadows
                            ? m_shadows.transmittance<Light>(i, p, in.direction, in.distance, rng,
                                                             counters.tracking, when)
                            : Light(1.0f);
  return transport::scatteringToward(m_medium, c, in.direction, wo) * in.irradiance * visible;
}

template <class Light, class When>
Rgb DirectLight::at(const Vec3f& p, const Vec3f& wo, const Coefficients& c, const MarchStep* step,
                    Rng& rng, IntegratorCounters& counters, When when) const {
  Rgb sum(0.0f);
  if (!m_choice) {
    for (const std::size_t i : m_lamps)
      sum += of<Light>(i, p, wo, c, step, rng, counters, when);
    return sum;
  }
  constexpr int drawn = LampChoice::kDrawn;
  const double offset = rng.uniformDouble();
  for (int k = 0; k < drawn; ++k) {
    const LampChoice::Drawn lamp = m_choice->at(p, (k + offset) / drawn);
    if (lamp.probability > 0.0f)
      sum += of<Light>(m_lamps[lamp.lamp], p, wo, c, step, rng, counters, when) /
             (static_cast<float>(drawn) * lamp.probability);
  }
  return sum;
}

#define PHOTOSPHERE_DIRECT(LIGHT, WHEN)                                                        \
  template Rgb DirectLight::at<LIGHT, WHEN>(const Vec3f&, const Vec3f&, const Coefficients&,   \
                                            const MarchStep*, Rng&, IntegratorCounters&, WHEN) \
      const;
PHOTOSPHERE_FOR_EACH_RAY(PHOTOSPHERE_DIRECT)
#undef PHOTOSPHERE_DIRECT

}  // namespace photosphere::render
