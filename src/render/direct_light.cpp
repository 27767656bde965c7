#include "direct_light.h"

#include <algorithm>
#include <cmath>

#include "instances.h"

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

Rgb phased(const Medium& medium, const Coefficients& c, const Vec3f& wi, const Vec3f& wo) {
  const auto& phases = medium.phases();
  Rgb sum(0.0f);
  for (std::size_t i = 0; i < phases.size(); ++i)
    sum += c.scattering[i] * phases[i].evaluate(wi, wo);
  return sum;
}

}  // namespace

DirectLight::DirectLight(const Medium& medium, const transport::LightList& lights,
                         const Shadows& shadows, bool useShadows, bool carried)
    : m_medium(medium), m_lights(lights), m_shadows(shadows), m_useShadows(useShadows) {
  for (std::size_t i = 0; i < lights.size(); ++i)
    if (lights[i]->isDelta() || !carried) m_lamps.push_back(i);
}

template <class Light, class When>
Rgb DirectLight::at(const Vec3f& p, const Vec3f& wo, const Coefficients& c, const MarchStep* step,
                    Rng& rng, IntegratorCounters& counters, When when) const {
  Rgb sum(0.0f);
  for (const std::size_t i : m_lamps) {
    const lights::Light& light = *m_lights[i];
    const Vec2f u = light.isDelta() ? Vec2f(0.5f) : rng.uniform2();
    lights::Illumination in = light.illuminate(p, u);
    if (!(maxComponent(in.irradiance) > 0.0f)) continue;
    if (step && in.distance < 8.0f * (step->t1 - step->t0))
      in.irradiance *= nearLampFactor(*step, p, in);
    const Light visible = m_useShadows
                              ? m_shadows.transmittance<Light>(i, p, in.direction, in.distance, rng,
                                                               counters.tracking, when)
                              : Light(1.0f);
    sum += phased(m_medium, c, in.direction, wo) * in.irradiance * visible;
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
