#include "direct_light.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "instances.h"
#include "photosphere/transport/scatter.h"

namespace photosphere::render {

namespace {

using transport::Coefficients;
using transport::Medium;

// Steps to a lamp, below which its light changes much within one.
constexpr float kNear = 8.0f;

// A point of a step, and what the light there stands for.
struct Drawn {
  Vec3f p;
  float weight;  // times the squared distance of `p`, softened by the lamp's extent [m^-2]
};

// Equiangular sampling (Kulla and Fajardo 2012): toward the lamp rather than away from it, as its
// light is, whose 1/d^2 then cancels. Nothing where the lamp is many steps away or many steps wide:
// the middle does.
std::optional<Drawn> drawNear(const MarchStep& step, const Vec3f& p, const lights::Place& lamp,
                              Rng& rng) {
  const Vec3f center(lamp.center);
  const auto extent = static_cast<float>(lamp.extent);
  const float length = step.t1 - step.t0;
  const Vec3f away = p - center;
  const float reach = kNear * length;
  if (!(extent < reach && glm::dot(away, away) < (reach + extent) * (reach + extent)))
    return std::nullopt;
  const float along = glm::dot(center - step.ray.origin, step.ray.direction);
  const Vec3f across = center - (step.ray.origin + step.ray.direction * along);
  const float h =
      std::max(std::sqrt(glm::dot(across, across) + extent * extent), 1e-6f * reach + 1e-20f);
  // The step is seen from `h` beside its line under this angle, of which a part is drawn.
  const float a = step.t0 - along, b = step.t1 - along;
  const float angle = std::atan2(h * length, h * h + a * b);
  const float part = rng.uniform() * angle;
  const float x = std::cos(part), y = std::sin(part);
  const float s = glm::clamp(h * (a * x + h * y) / (h * x - a * y), a, b);
  return Drawn{step.ray.origin + step.ray.direction * (along + s), angle / (h * length)};
}

}  // namespace

DirectLight::DirectLight(const Medium& medium, const transport::LightList& lights,
                         const Shadows& shadows, bool useShadows, bool carried)
    : m_medium(medium), m_lights(lights), m_shadows(shadows), m_useShadows(useShadows) {
  std::vector<const lights::Light*> lamps;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    m_places.push_back(lights[i]->place());
    if (lights[i]->isDelta() || !carried) {
      m_lamps.push_back(i);
      lamps.push_back(lights[i].get());
    }
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
  const std::optional<lights::Place>& place = m_places[i];
  std::optional<Drawn> drawn;
  if (step && place) drawn = drawNear(*step, p, *place, rng);
  const Vec3f at = drawn ? drawn->p : p;
  lights::Illumination in = light.illuminate(at, u);
  if (!(maxComponent(in.irradiance) > 0.0f)) return Rgb(0.0f);
  if (drawn) {
    // Of a point the distance that its light was divided by, so that rounding cancels as well.
    const auto extent = static_cast<float>(place->extent);
    const Vec3f away = at - Vec3f(place->center);
    in.irradiance *= drawn->weight * (light.isDelta() ? in.distance * in.distance
                                                      : glm::dot(away, away) + extent * extent);
  }
  const Light visible = m_useShadows
                            ? m_shadows.transmittance<Light>(i, at, in.direction, in.distance, rng,
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
