#include "final_gather.h"

#include <algorithm>
#include <cmath>

#include "photosphere/transport/scatter.h"

namespace photosphere::render {

using transport::Coefficients;
using transport::Collision;

float RayOpacity::sample(float u) const {
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
  return at->begin + at->length * std::min(inside, 1.0f);
}

FinalGather::FinalGather(const transport::Medium& medium, DirectLight direct,
                         const estimators::InscatterSource& source, const Effects& effects,
                         int rays)
    : m_medium(medium),
      m_direct(std::move(direct)),
      m_source(source),
      m_emission(effects.emission ? medium.emission() : nullptr),
      m_rays(rays) {}

Rgb FinalGather::multiple(const transport::Segment& ray, const RayOpacity& opacity, Rng& rng,
                          IntegratorCounters& counters) const {
  if (!(opacity.total() > 0.0f)) return Rgb(0.0f);
  Rgb sum(0.0f);
  const float stratum = 1.0f / static_cast<float>(m_rays);
  for (int i = 0; i < m_rays; ++i) {
    const float t = opacity.sample((static_cast<float>(i) + rng.uniform()) * stratum);
    const Vec3f p = ray.origin + ray.direction * t;
    const transport::ScatterEvent event = transport::scatter(m_medium, p, ray.direction, rng);
    if (event.survived) sum += event.weight * arriving(p, event.direction, rng, counters);
  }
  return sum * (opacity.total() * stratum);
}

// Radiance that arrives at `p` from `d`, but for lamps and surroundings seen through the smoke:
// what they send scatters at `p` for the first time and is `single`.
Rgb FinalGather::arriving(const Vec3f& p, const Vec3f& d, Rng& rng,
                          IntegratorCounters& counters) const {
  const Collision hit =
      transport::sampleCollision(m_medium, p, d, kInfinity, rng, counters.tracking);
  Rgb radiance(0.0f);
  if (m_emission)
    radiance += transport::sampleEmission(m_medium, *m_emission, p, d, hit.distance, rng);
  if (!hit.happened()) return radiance;
  ++counters.scatterings;
  const Vec3f q = p + d * hit.distance;
  Coefficients c;
  m_medium.coefficients(q, c);
  if (!(c.extinction > 0.0f)) return radiance;
  const estimators::Inscatter in = m_source.at(q, -d, c);
  const Rgb lamps = m_direct.at(q, -d, c, nullptr, rng, counters);
  return radiance + (lamps + in.single + in.multiple) / c.extinction;
}

}  // namespace photosphere::render
