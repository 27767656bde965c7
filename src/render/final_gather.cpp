#include "final_gather.h"

#include <algorithm>
#include <cmath>

#include "instances.h"

namespace photosphere::render {

using transport::Coefficients;
using transport::Collision;

RayOpacity::Place RayOpacity::sample(float u) const {
  const float target = u * total();
  const auto found =
      std::upper_bound(m_steps.begin(), m_steps.end(), target,
                       [](float value, const Step& step) { return value < step.opacity; });
  const auto at = found == m_steps.end() ? found - 1 : found;
  const float before = at == m_steps.begin() ? 0.0f : (at - 1)->opacity;
  // Within a step the opacity grows as 1 - exp(-sigma t).
  const float part = std::clamp((target - before) / (at->opacity - before), 0.0f, 1.0f);
  const float depth = at->extinction * at->length;
  const float inside =
      depth > 1e-3f ? -fastLog(1.0f - part * (1.0f - fastExp(-depth))) / depth : part;
  const float mean = meanComponent(at->removed);
  return {at->begin + at->length * std::min(inside, 1.0f), at->begin + 0.5f * at->length,
          mean > 0.0f ? at->removed / mean : Rgb(1.0f)};
}

FinalGather::FinalGather(const transport::Medium& medium, DirectLight direct,
                         const estimators::InscatterSource& source, const Effects& effects,
                         int rays)
    : m_medium(medium),
      m_direct(std::move(direct)),
      m_source(source),
      m_emission(effects.emission ? medium.emission() : nullptr),
      m_rays(rays) {}

// What becomes of light that does meet something at a point.
template <class When>
transport::ScatterEvent FinalGather::scatterAt(const Vec3f& p, const Vec3f& wi, const Rgb& power,
                                               Rng& rng, When when) const {
  if (!m_medium.isColoured()) return transport::scatter(m_medium, p, wi, power, rng, when);
  Coefficients c;
  m_medium.coefficients(p, c, when);
  return transport::scatterColoured(m_medium, c, Rgb(0.0f),
                                    m_medium.channels(p, c.extinction, when), wi, power, rng);
}

template <class Light, class When>
Rgb FinalGather::multiple(const transport::Segment& ray, const RayOpacity& opacity, Rng& rng,
                          IntegratorCounters& counters, When when) const {
  if (!(opacity.total() > 0.0f)) return Rgb(0.0f);
  Rgb sum(0.0f);
  const float stratum = 1.0f / static_cast<float>(m_rays);
  for (int i = 0; i < m_rays; ++i) {
    const RayOpacity::Place place =
        opacity.sample((static_cast<float>(i) + rng.uniform()) * stratum);
    Vec3f p = ray.origin + ray.direction * place.distance;
    // Part of a step may lie outside the smoke; its middle does not.
    if (!(m_medium.extinction(p, when) > 0.0f)) p = ray.origin + ray.direction * place.middle;
    const transport::ScatterEvent event = scatterAt(p, ray.direction, place.removed, rng, when);
    if (event.survived)
      sum += arriving<Light>(p, event.direction, place.removed * event.weight, rng, counters, when);
  }
  return sum * (opacity.total() * stratum);
}

// Radiance that arrives at `p` from `d`, times a power: all but lamps and surroundings seen through
// the smoke, as what they send scatters at `p` for the first time and is `single`.
template <class Light, class When>
Rgb FinalGather::arriving(Vec3f p, const Vec3f& d, const Rgb& power, Rng& rng,
                          IntegratorCounters& counters, When when) const {
  Rgb radiance(0.0f), left = power;
  while (true) {
    const Collision hit =
        transport::sampleCollisionOf(left, m_medium, p, d, kInfinity, rng, counters.tracking, when);
    if (m_emission)
      radiance +=
          left * transport::sampleEmission(m_medium, *m_emission, p, d, hit.distance, rng, when);
    if (!hit.happened()) return radiance;
    ++counters.scatterings;
    p += d * hit.distance;
    Coefficients c;
    m_medium.coefficients(p, c, when);
    if (!(c.extinction > 0.0f)) return radiance;
    const estimators::Inscatter in = m_source.at(m_medium.carrierOf(p, when), -d, c);
    const Rgb lamps = m_direct.at<Light>(p, -d, c, nullptr, rng, counters, when);
    const float rate = c.extinction * hit.share;
    radiance += left * (lamps + in.single + in.multiple) / rate;
    if constexpr (std::is_same_v<Light, float>) return radiance;
    // Each channel passes by its own chance what was a collision for the densest.
    const Rgb passes = transport::passingChance(rate, m_medium.channels(p, c.extinction, when));
    const float sum = left.x + left.y + left.z;
    const float pass = sum > 0.0f ? glm::dot(left, passes) / sum : 0.0f;
    if (!(rng.uniform() < pass)) return radiance;
    left *= passes / pass;
    left *= transport::rouletteOfFaint(left, rng);
  }
}

#define PHOTOSPHERE_GATHER(LIGHT, WHEN)                                                         \
  template Rgb FinalGather::multiple<LIGHT, WHEN>(const transport::Segment&, const RayOpacity&, \
                                                  Rng&, IntegratorCounters&, WHEN) const;
PHOTOSPHERE_FOR_EACH_RAY(PHOTOSPHERE_GATHER)
#undef PHOTOSPHERE_GATHER

}  // namespace photosphere::render
