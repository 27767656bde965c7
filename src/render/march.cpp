#include <algorithm>

#include "photosphere/render/integrator.h"

namespace photosphere::render {

namespace {

using transport::Coefficients;
using transport::Medium;
using transport::Segment;

// Transmittance below which the rest of a ray is not marched: far under half-float resolution of
// what it could still add.
constexpr float kOpaque = 1e-5f;
// Largest optical depth of one step by the cell's majorant, and the finest step it may ask for as a
// part of the user's.
constexpr float kStepDepth = 0.5f;
constexpr float kFinest = 1.0f / 16.0f;

class MarchIntegrator final : public Integrator {
 public:
  MarchIntegrator(const Medium& medium, const transport::LightList& lights, const Shadows& shadows,
                  const estimators::InscatterSource* source, const MarchOptions& options)
      : m_medium(medium),
        m_lights(lights),
        m_shadows(shadows),
        m_source(source),
        m_options(options),
        m_emission(options.effects.emission ? medium.emission() : nullptr),
        m_step(static_cast<float>(medium.voxelEdge()) * options.step) {
    if (m_emission)
      m_step = std::min(m_step, static_cast<float>(m_emission->region().spacing) * options.step);
    const bool carried = source && source->carriesUnscattered();
    for (std::size_t i = 0; i < lights.size(); ++i)
      if (lights[i]->isDelta() || !carried) m_direct.push_back(i);
  }

  RayRadiance radiance(const Vec3d& origin, const Vec3f& direction, Rng& rng,
                       IntegratorCounters& counters) const override {
    RayRadiance result;
    const Segment ray = transport::clipToMedium(m_medium, origin, direction,
                                                std::numeric_limits<double>::infinity());
    float transmittance = 1.0f;
    if (ray.length > 0.0f) transmittance = march(ray, result, rng, counters);
    result.transmittance = Rgb(transmittance);
    for (const auto& light : m_lights)
      result.background += transmittance * light->background(direction);
    return result;
  }

 private:
  // Steps lie on one lattice along the ray, offset at random, so that neighbouring rays do not
  // band; cells without extinction and emission are skipped.
  float march(const Segment& ray, RayRadiance& result, Rng& rng,
              IntegratorCounters& counters) const {
    float transmittance = 1.0f;
    const float offset = rng.uniform();
    float done = 0.0f;  // the ray is integrated up to here
    for (volume::MajorantGrid::Walk walk(m_medium.majorants(), ray.origin, ray.direction, 0.0f,
                                         ray.length);
         !walk.done(); walk.advance()) {
      if (!(walk.majorant() > 0.0f) && !(m_emission && m_emission->inCell(walk.cell()))) continue;
      const float end = walk.end();
      // The source inside a step varies by the extinction of the light on its way in, which the
      // midpoint rule sees to (depth)^2 / 24: dense smoke takes finer steps, in powers of two of
      // one lattice.
      float h = m_step;
      while (h * walk.majorant() > kStepDepth && h > m_step * kFinest)
        h *= 0.5f;
      float t0 = std::max(done, walk.begin());
      while (t0 < end) {
        // The next point of the step lattice beyond t0; a step may run on past the cell, where the
        // following cell then begins later.
        float t1 = (std::floor(t0 / h - offset) + 1.0f + offset) * h;
        if (!(t1 > t0 + 1e-3f * h)) t1 += h;
        t1 = std::min(t1, ray.length);
        if (!(t1 > t0)) break;
        transmittance = step(ray, t0, t1, transmittance, result, rng, counters);
        if (transmittance < kOpaque) return 0.0f;
        t0 = t1;
      }
      done = std::max(done, t0);
    }
    return transmittance;
  }

  float step(const Segment& ray, float t0, float t1, float transmittance, RayRadiance& result,
             Rng& rng, IntegratorCounters& counters) const {
    const float dx = t1 - t0;
    const float t = 0.5f * (t0 + t1);
    const Vec3f p = ray.origin + ray.direction * t;
    Coefficients c;
    if (const Rgb* albedo = m_medium.uniformAlbedo()) {
      c.extinction = m_medium.extinction(p);
      c.scattering[0] = c.extinction * *albedo;
    } else {
      m_medium.coefficients(p, c);
    }
    if (!(c.extinction > 0.0f)) {
      if (m_emission) result.emission += transmittance * dx * m_emission->at(p);
      return transmittance;
    }
    const float depth = c.extinction * dx;
    // (1 - exp(-x)) / x, its series where the difference would cancel.
    const float attenuated = fastExp(-depth);
    const float average = depth > 1e-3f ? (1.0f - attenuated) / depth : 1.0f - 0.5f * depth;
    const float weight = transmittance * average * dx;
    const Vec3f wo = -ray.direction;
    if (m_emission) result.emission += weight * m_emission->at(p);
    if (m_options.effects.singleScattering)
      result.single += weight * direct(ray, p, t0, t1, wo, c, rng, counters);
    if (m_source) {
      const estimators::Inscatter in = m_source->at(p, wo, c);
      result.single += weight * in.single;
      result.multiple += weight * in.multiple;
    }
    const float absorbed = transmittance * average * depth;
    result.opacity += absorbed;
    result.depth += absorbed * (static_cast<float>(ray.begin) + t);
    return transmittance * attenuated;
  }

  // Light of the lamps that scatters once, here, toward the eye [W m^-3 sr^-1].
  Rgb direct(const Segment& ray, const Vec3f& p, float t0, float t1, const Vec3f& wo,
             const Coefficients& c, Rng& rng, IntegratorCounters& counters) const {
    Rgb sum(0.0f);
    for (const std::size_t i : m_direct) {
      const lights::Light& light = *m_lights[i];
      const Vec2f u = light.isDelta() ? Vec2f(0.5f) : rng.uniform2();
      lights::Illumination in = light.illuminate(p, u);
      if (!(maxComponent(in.irradiance) > 0.0f)) continue;
      if (in.distance < 8.0f * (t1 - t0)) in.irradiance *= nearLampFactor(ray, p, t0, t1, in);
      const float visible =
          m_options.effects.shadows
              ? m_shadows.transmittance(i, p, in.direction, in.distance, rng, counters.tracking)
              : 1.0f;
      sum += phased(c, in.direction, wo) * in.irradiance * visible;
    }
    return sum;
  }

  // Mean of 1/d^2 over the step, over its value at the middle: the integral has a closed form (the
  // substitution of equiangular sampling), so a lamp inside the smoke costs no subdivision.
  static float nearLampFactor(const Segment& ray, const Vec3f& p, float t0, float t1,
                              const lights::Illumination& in) {
    const Vec3f lamp = p - in.direction * in.distance;
    const float along = glm::dot(lamp - ray.origin, ray.direction);
    const Vec3f foot = ray.origin + ray.direction * along;
    const Vec3f across = lamp - foot;
    const float h = std::max(std::sqrt(glm::dot(across, across)), 1e-6f * in.distance + 1e-20f);
    const float angle = std::atan((t1 - along) / h) - std::atan((t0 - along) / h);
    return angle / (h * (t1 - t0)) * in.distance * in.distance;
  }

  Rgb phased(const Coefficients& c, const Vec3f& wi, const Vec3f& wo) const {
    const auto& phases = m_medium.phases();
    Rgb sum(0.0f);
    for (std::size_t i = 0; i < phases.size(); ++i)
      sum += c.scattering[i] * phases[i].evaluate(wi, wo);
    return sum;
  }

  const Medium& m_medium;
  const transport::LightList& m_lights;
  const Shadows& m_shadows;
  const estimators::InscatterSource* m_source;
  MarchOptions m_options;
  const transport::Emission* m_emission;  // nullptr where there is none
  float m_step;
  std::vector<std::size_t> m_direct;  // lamps whose single scattering is evaluated here
};

}  // namespace

std::unique_ptr<Integrator> makeMarchIntegrator(const Medium& medium,
                                                const transport::LightList& lights,
                                                const Shadows& shadows,
                                                const estimators::InscatterSource* source,
                                                const MarchOptions& options) {
  return std::make_unique<MarchIntegrator>(medium, lights, shadows, source, options);
}

}  // namespace photosphere::render
