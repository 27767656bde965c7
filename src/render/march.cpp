#include <algorithm>
#include <cmath>
#include <optional>
#include <type_traits>

#include "backgrounds.h"
#include "final_gather.h"
#include "instances.h"

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

float exponential(float x) {
  return fastExp(x);
}
Rgb exponential(const Rgb& x) {
  return {fastExp(x.x), fastExp(x.y), fastExp(x.z)};
}
// (1 - exp(-x)) / x, its series where the difference would cancel.
float averaged(float depth, float attenuated) {
  return depth > 1e-3f ? (1.0f - attenuated) / depth : 1.0f - 0.5f * depth;
}
Rgb averaged(const Rgb& depth, const Rgb& attenuated) {
  return {averaged(depth.x, attenuated.x), averaged(depth.y, attenuated.y),
          averaged(depth.z, attenuated.z)};
}
float meanOf(float value) {
  return value;
}
float meanOf(const Rgb& value) {
  return meanComponent(value);
}
// Extinction that light met, of several channels the mean by what each lost.
float metBy(float, float extinction) {
  return extinction;
}
float metBy(const Rgb& removed, const Rgb& extinction) {
  const float sum = removed.x + removed.y + removed.z;
  return sum > 0.0f ? glm::dot(removed, extinction) / sum : meanComponent(extinction);
}

// Part of a step that is next to nothing.
constexpr float kBeside = 1e-3f;

// Whether smoke begins gradually where it begins, rather than with a jump.
// @param within  extinction farther in
bool isFoot(float extinction, float within) {
  return extinction <= 0.5f * within;
}

// What the light that is left needs of the densest channel's extinction (Medium::livingShare).
// Channels end one by one, so that one that has ended does not keep the others at its pace.
float livingShare(const Medium&, float) {
  return 1.0f;
}
float livingShare(const Medium& medium, Rgb& transmittance) {
  for (int channel = 0; channel < 3; ++channel)
    if (transmittance[channel] < kOpaque) transmittance[channel] = 0.0f;
  return medium.livingShare(transmittance);
}

// Light is what transmittances are made of: float, or Rgb where extinction differs from channel to
// channel. When is Still, or Moment where the smoke moves.
template <class Light, class When>
class MarchIntegrator final : public Integrator {
 public:
  MarchIntegrator(const Medium& medium, const transport::LightList& lights, const Shadows& shadows,
                  const estimators::InscatterSource* source, const MarchOptions& options)
      : m_medium(medium),
        m_backgrounds(backgroundsOf(medium, lights)),
        m_direct(medium, lights, shadows, options.effects.shadows,
                 source && source->carriesUnscattered()),
        m_source(source),
        m_options(options),
        m_emission(options.effects.emission ? medium.emission() : nullptr),
        m_step(static_cast<float>(medium.voxelEdge()) * options.step) {
    if (m_emission)
      m_step = std::min(m_step, static_cast<float>(m_emission->region().spacing) * options.step);
    m_stepsPerLength = 1.0f / m_step;
    m_voxel = static_cast<float>(medium.voxelEdge()) * 1.001f;
    m_thick = kStepDepth / (m_step * kFinest);
    if (source && options.gatherRays > 0)
      m_gather.emplace(medium, m_direct.withShadows(), *source, options.effects,
                       options.gatherRays);
  }

  RayRadiance radiance(const Vec3d& origin, const Vec3f& direction, transport::Moment moment,
                       Rng& rng, IntegratorCounters& counters) const override {
    When when;
    if constexpr (std::is_same_v<When, transport::Moment>) when = moment;
    RayRadiance result;
    const Segment ray = transport::clipToMedium(m_medium, origin, direction,
                                                std::numeric_limits<double>::infinity());
    Light transmittance(1.0f);
    if (ray.length > 0.0f && m_gather) {
      static thread_local RayOpacity opacity;
      opacity.clear();
      transmittance = march(ray, when, &opacity, result, rng, counters);
      result.multiple = m_gather->multiple<Light>(ray, opacity, rng, counters, when);
    } else if (ray.length > 0.0f) {
      transmittance = march(ray, when, nullptr, result, rng, counters);
    }
    // Noise of stored light may leave less than none.
    result.single = glm::max(result.single, Rgb(0.0f));
    result.multiple = glm::max(result.multiple, Rgb(0.0f));
    result.transmittance = Rgb(transmittance);
    for (const lights::Light* light : m_backgrounds)
      result.background += transmittance * light->background(direction);
    return result;
  }

 private:
  // Steps lie on one lattice along the ray, offset at random, so that neighbouring rays do not
  // band; cells without extinction and emission are skipped. The midpoint rule gives too much where
  // smoke has its ridge and too little at its feet, which is right on the mean of all offsets: so
  // the step over a foot is a whole one too, though part of it lies outside. Smoke that ends at a
  // face, where its extinction jumps, is integrated up to the face.
  Light march(const Segment& ray, When when, RayOpacity* opacity, RayRadiance& result, Rng& rng,
              IntegratorCounters& counters) const {
    Light transmittance(1.0f);
    const auto extinction = m_medium.alongRay(ray.origin, ray.direction, when);
    const float offset = rng.uniform();
    // The ray is integrated up to here.
    float done = ray.begin > 0.0 ? -kInfinity : 0.0f;
    for (volume::MajorantGrid::Walk walk(m_medium.majorants(), ray.origin, ray.direction, 0.0f,
                                         ray.length);
         !walk.done(); walk.advance()) {
      if (!(walk.majorant() > 0.0f) && !(m_emission && m_emission->inCell(walk.cell()))) continue;
      throwIfInterrupted();
      const float end = walk.end();
      const float share = livingShare(m_medium, transmittance);
      const float majorant = walk.majorant() * share;
      if (majorant > m_thick) {
        const MarchStep rest{ray, std::max(done, walk.begin()), end};
        if (!marchThick(rest, walk.majorant(), extinction, when, transmittance, opacity, result,
                        rng, counters))
          return Light(0.0f);
        done = std::max(done, end);
        continue;
      }
      const CellStep cell = stepIn(walk.cell(), majorant);
      const float h = cell.length;
      Vec3f carrier(0.0f);  // read where smoke moves
      const auto rises = [&](float from, float to) {
        return isFoot(extinctionAt(extinction, ray, from, when, carrier),
                      extinctionAt(extinction, ray, to, when, carrier)) &&
               (!m_emission || isFoot(glowAt(ray, from, when), glowAt(ray, to, when)));
      };
      float t0 = std::max(done, walk.begin());
      // The next point of the step lattice beyond t0; a step may run on past the cell, where the
      // following cell then begins later.
      double k = std::floor(static_cast<double>(t0) * static_cast<double>(cell.perLength) -
                            static_cast<double>(offset)) +
                 1.0;
      const auto place = [&](double number) {
        return static_cast<float>((number + static_cast<double>(offset)) * static_cast<double>(h));
      };
      // Else features are shorter than steps.
      const bool whole = h <= cell.coarseness * m_voxel;
      if (whole && done < t0 && rises(t0 + kBeside * h, 0.5f * (t0 + place(k))))
        t0 = std::max(done, place(k - 1.0));
      for (; t0 < end; k += 1.0) {
        float t1 = place(k);
        const float cut = cell.coarseness > 1.0f ? upToFiner(walk, t1, h, share) : t1;
        const bool atFiner = cut < t1;
        t1 = cut;
        if (t1 > ray.length &&
            !(whole && rises(ray.length - kBeside * h, 0.5f * (t0 + ray.length))))
          t1 = ray.length;
        if (!(t1 > t0 + kBeside * h)) {
          if (t1 == ray.length || atFiner) break;
          continue;
        }
        const float sigma = extinctionAt(extinction, ray, 0.5f * (t0 + t1), when, carrier);
        if (sigma > 0.0f)
          transmittance = step({ray, t0, t1}, sigma, carrier, when, transmittance, opacity, result,
                               rng, counters);
        else if (m_emission)
          result.emission +=
              transmittance * (t1 - t0) *
              m_medium.emitted(ray.origin + ray.direction * (0.5f * (t0 + t1)), when);
        if (transport::largestOf(transmittance) < kOpaque) return Light(0.0f);
        t0 = t1;
      }
      done = std::max(done, t0);
    }
    return transmittance;
  }

  float glowAt(const Segment& ray, float t, When when) const {
    return maxComponent(m_medium.emitted(ray.origin + ray.direction * t, when));
  }

  // Steps in a cell.
  struct CellStep {
    float coarseness;  // of its voxels, MajorantGrid::coarseness
    float length;      // [m]
    float perLength;   // its inverse
  };
  // The source inside a step varies by the extinction of the light on its way in, which the
  // midpoint rule sees to (depth)^2 / 24: dense smoke takes finer steps, in powers of two of one
  // lattice. Where all voxels are coarser steps may be as long as those, at most.
  // @param majorant  of the light that is left
  CellStep stepIn(std::size_t cell, float majorant) const {
    const float coarseness = m_emission ? 1.0f : m_medium.majorants().coarseness(cell);
    float coarser = coarseness;
    while (coarser > 1.0f && m_step * coarser > m_voxel * coarseness)
      coarser *= 0.5f;
    CellStep step{coarseness, m_step * coarser, m_stepsPerLength / coarser};
    while (step.length * majorant > kStepDepth && step.length > m_step * kFinest) {
      step.length *= 0.5f;
      step.perLength *= 2.0f;
    }
    return step;
  }

  // A step of length `h` from a cell of coarse voxels, many of which such a step may pass: up to
  // the next where steps are shorter.
  float upToFiner(volume::MajorantGrid::Walk walk, float t1, float h, float share) const {
    for (; !walk.done() && walk.begin() < t1; walk.advance()) {
      const float majorant = walk.majorant() * share;
      if (majorant > m_thick || stepIn(walk.cell(), majorant).length < h) return walk.begin();
    }
    return t1;
  }

  // A cell where the finest steps of the lattice would be too coarse: each step is as long as keeps
  // its own depth small. @return false when the ray has ended dark
  template <class Along>
  bool marchThick(const MarchStep& cell, float majorant, const Along& extinction, When when,
                  Light& transmittance, RayOpacity* opacity, RayRadiance& result, Rng& rng,
                  IntegratorCounters& counters) const {
    const float steepness = m_medium.steepness();
    for (float t0 = cell.t0; t0 < cell.t1;) {
      Vec3f carrier(0.0f);
      const float share = livingShare(m_medium, transmittance);
      const float here = transport::extinctionOnward(
          [&](float t) { return extinctionAt(extinction, cell.ray, t, when, carrier); }, t0,
          1.0f / steepness);
      const float part = std::min(
          m_step, transport::thinPart(here * share, majorant * share * steepness, kStepDepth));
      const float t1 = std::min(t0 + std::max(part, transport::kDistanceResolution * t0), cell.t1);
      const float middle = 0.5f * (t0 + t1);
      const float sigma = extinctionAt(extinction, cell.ray, middle, when, carrier);
      if (sigma > 0.0f)
        transmittance = step({cell.ray, t0, t1}, sigma, carrier, when, transmittance, opacity,
                             result, rng, counters);
      else if (m_emission)
        result.emission += transmittance * (t1 - t0) *
                           m_medium.emitted(cell.ray.origin + cell.ray.direction * middle, when);
      if (transport::largestOf(transmittance) < kOpaque) return false;
      t0 = t1;
    }
    return true;
  }

  template <class Along>
  static float extinctionAt(const Along& along, const Segment&, float t, transport::Still, Vec3f&) {
    return along(t);
  }
  template <class Along>
  float extinctionAt(const Along&, const Segment& ray, float t, transport::Moment when,
                     Vec3f& carrier) const {
    return m_medium.extinction(ray.origin + ray.direction * t, when, carrier);
  }

  // A step through extinction. @param carrier  Medium::carrierOf its middle, where smoke moves
  Light step(const MarchStep& step, float sigma, const Vec3f& carrier, When when,
             const Light& transmittance, RayOpacity* opacity, RayRadiance& result, Rng& rng,
             IntegratorCounters& counters) const {
    const Segment& ray = step.ray;
    const float dx = step.t1 - step.t0;
    const float t = 0.5f * (step.t0 + step.t1);
    const Vec3f p = ray.origin + ray.direction * t;
    Coefficients c;
    if (const Rgb* albedo = m_medium.uniformAlbedo()) {
      c.extinction = sigma;
      c.scattering[0] = sigma * *albedo;
    } else {
      m_medium.coefficients(p, c, when);
      // The same place, but for rounding.
      if (!(c.extinction > 0.0f)) return transmittance;
    }
    const Light own = transport::extinctionAs<Light>(m_medium, p, c.extinction, when);
    const Light depth = own * dx;
    const Light attenuated = exponential(-depth);
    const Light average = averaged(depth, attenuated);
    const Light weight = transmittance * average * dx;
    const Vec3f wo = -ray.direction;
    if (m_emission) result.emission += weight * m_medium.emitted(p, when);
    if (m_options.effects.singleScattering)
      result.single += weight * m_direct.at<Light>(p, wo, c, &step, rng, counters, when);
    if (m_source && !(m_gather && !m_source->carriesUnscattered())) {
      const estimators::Inscatter in =
          m_source->at(std::is_same_v<When, transport::Still> ? p : carrier, wo, c);
      result.single += weight * in.single;
      result.multiple += weight * in.multiple;
    }
    const Light removed = transmittance * average * depth;
    const float absorbed = meanOf(removed);
    result.opacity += absorbed;
    result.depth += absorbed * (static_cast<float>(ray.begin) + t);
    if (opacity) opacity->add(step.t0, step.t1, metBy(removed, own), result.opacity, Rgb(removed));
    return transmittance * attenuated;
  }

  const Medium& m_medium;
  std::vector<const lights::Light*> m_backgrounds;
  DirectLight m_direct;
  const estimators::InscatterSource* m_source;
  MarchOptions m_options;
  const transport::Emission* m_emission;  // nullptr where there is none
  float m_step;                           // [m]
  float m_stepsPerLength;                 // its inverse
  float m_voxel;                          // of the finest volume [m]
  float m_thick;                          // extinction from where on steps choose their length
  std::optional<FinalGather> m_gather;
};

}  // namespace

std::unique_ptr<Integrator> makeMarchIntegrator(const Medium& medium,
                                                const transport::LightList& lights,
                                                const Shadows& shadows,
                                                const estimators::InscatterSource* source,
                                                const MarchOptions& options) {
  return makeFor(medium, [&]<class Light, class When>(Light, When) -> std::unique_ptr<Integrator> {
    return std::make_unique<MarchIntegrator<Light, When>>(medium, lights, shadows, source, options);
  });
}

}  // namespace photosphere::render
