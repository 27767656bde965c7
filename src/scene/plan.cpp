#include "photosphere/scene/plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "aim.h"
#include "estimator_options.h"
#include "layer_renderer.h"
#include "light_stage.h"
#include "photon_map_stage.h"
#include "photosphere/core/resources.h"

namespace photosphere::scene {

namespace {

// Photons of the first short trace; each further one has four times as many, until they take this
// long beside what every trace takes.
constexpr std::uint64_t kFirstPhotons = 1 << 14;
constexpr double kLongEnough = 0.3;
// Crops across and down the frame, and their edge [pixels].
constexpr int kCropsAcross = 8, kCropsDown = 5, kCropEdge = 8;
// Samples of a pixel of these crops are enough to tell what one costs.
constexpr std::int64_t kMostSamples = 4;

struct Light {
  std::unique_ptr<estimators::InscatterSource> source;
  std::uint64_t photons = 0;
  double trace = 0, resolve = 0;  // [s]
};

Light traceLight(const SceneFile& scene, const RenderRequest& request,
                 const LayerRenderer& renderer, FrameSetup& setup) {
  Light light;
  light.photons = setup.photons;
  FrameStatistics statistics;
  const Stopwatch tracing;
  if (setup.lightPaths) {
    renderer.lightPaths(nullptr, 0, statistics);
    light.trace = tracing.seconds();
    return light;
  }
  if (setup.photonMap) {
    light.source = photonMapPass(setup, 0, 1.0, statistics);
    light.trace = tracing.seconds();
    return light;
  }
  estimators::LightField field = lightField(scene, request, setup, statistics);
  light.trace = tracing.seconds();
  const Stopwatch resolving;
  light.source = estimators::resolve(*setup.medium, std::move(field), setup.view, setup.key);
  light.resolve = resolving.seconds();
  return light;
}

// Seconds at `wanted` photons of what took `before` and `after` seconds at fewer.
double extrapolate(const Light& first, double before, const Light& last, double after,
                   std::uint64_t wanted) {
  if (last.photons <= first.photons || last.photons >= wanted) return after;
  const double each = (after - before) / static_cast<double>(last.photons - first.photons);
  return after + std::max(0.0, each) * static_cast<double>(wanted - last.photons);
}

// What a frame's rays take, and what is made before the first.
class RayCost {
 public:
  RayCost(const SceneFile& scene, const FrameSetup& setup) : m_setup(setup) {
    SceneFile fewer = scene;
    for (ParamValues* values : {&fewer.estimator, &fewer.render})
      values->setText(
          "samples",
          std::to_string(std::min(kMostSamples * setup.batches, values->integer("samples"))),
          "plan");
    const Stopwatch watch;
    m_some.emplace(fewer, render::Crop{{0, 0}, setup.camera->resolution()}, setup);
    m_before = watch.seconds();
    const bool paths = sendsPaths(scene);
    const auto samples = [&](const SceneFile& s) {
      const std::int64_t n = (paths ? s.estimator : s.render).integer("samples");
      const std::int64_t inOne = (n + setup.batches - 1) / setup.batches;
      return static_cast<double>(inOne);
    };
    m_rays = m_some->rays({{0, 0}, setup.camera->resolution()}) * samples(scene) / samples(fewer);
  }
  double before() const { return m_before; }
  std::uint64_t memoryBytes() const { return m_some->memoryBytes(); }

  const LayerRenderer& renderer() const { return *m_some; }

  // Of one pass [s].
  double seconds(const estimators::InscatterSource* source) const {
    const Vec2i size = m_setup.camera->resolution();
    double rays = 0;
    std::vector<render::Crop> crops;
    for (int y = 0; y < kCropsDown; ++y)
      for (int x = 0; x < kCropsAcross; ++x) {
        const Vec2d middle = (Vec2d(x, y) + 0.5) / Vec2d(kCropsAcross, kCropsDown) * Vec2d(size);
        const Vec2i low = glm::max(Vec2i(middle) - kCropEdge / 2, Vec2i(0));
        crops.push_back({low, glm::min(low + kCropEdge, size)});
        rays += m_some->rays(crops.back());
      }
    const Stopwatch watch;
    for (const render::Crop& crop : crops)
      m_some->renderCrop(source, 0, crop);
    return watch.seconds() / rays * m_rays;
  }

 private:
  const FrameSetup& m_setup;
  std::optional<LayerRenderer> m_some;
  double m_before = 0, m_rays = 0;
};

void predict(const SceneFile& scene, const RenderRequest& request, FrameSetup& setup,
             FramePlan& plan) {
  StageSeconds& s = plan.seconds;
  const int passes = setup.photonMap ? setup.photonMap->passes : 1;
  const int parts = setup.batches * passes;
  const std::uint64_t wanted = setup.photons;
  const RayCost rays(scene, setup);
  plan.memory.shadows = rays.memoryBytes();
  Light first, last;
  if (storesLight(scene, setup) || setup.lightPaths) {
    const bool cached = !scene.estimator.text("cache").empty();
    if (!cached) setup.photons = std::min(wanted, kFirstPhotons);
    first = traceLight(scene, request, rays.renderer(), setup);
    double trace = first.trace, march = rays.seconds(first.source.get());
    const double marchFirst = march;
    if (cached) {
      s.read += trace;
      trace = 0;
      s.resolve = first.resolve;
    }
    while (!cached && setup.photons < wanted) {
      setup.photons = std::min(wanted, setup.photons * 4);
      last = traceLight(scene, request, rays.renderer(), setup);
      if (last.trace - first.trace > kLongEnough) break;
    }
    if (last.photons > 0) {
      trace = extrapolate(first, first.trace, last, last.trace, wanted);
      march = rays.seconds(last.source.get());
      // A photon map takes longer to look up the more it holds.
      if (setup.photonMap) march = extrapolate(first, marchFirst, last, march, wanted);
    }
    s.trace = trace * parts;
    if (!cached) s.resolve = (last.photons > 0 ? last.resolve : first.resolve) * parts;
    s.march = rays.before() + march * parts;
    setup.photons = wanted;
  } else {
    s.march = rays.before() + rays.seconds(nullptr) * parts;
  }
}

}  // namespace

FramePlan planScene(const SceneFile& written, std::int64_t frame, const RenderRequest& request) {
  const SceneFile scene = sceneAt(written, static_cast<double>(frame));
  SetupOptions options;
  options.resolution = request.resolution;
  options.seed = request.seed;
  options.cacheFrame = request.cacheFrame;
  const Stopwatch watch;
  FrameSetup setup = setUpFrame(scene, frame, options);
  aimLight(scene, {Vec2i(0), setup.camera->resolution()}, setup);
  const double setUp = watch.seconds();
  const bool stored = storesLight(scene, setup);
  FramePlan plan;
  plan.frame = frame;
  plan.resolution = setup.camera->resolution();
  plan.estimator = scene.estimator.text("type");
  if (stored && !setup.photonMap) plan.layout = describeLayout(setup.layout);
  plan.smoke = setup.worldBounds;
  plan.effects = setup.effectStates;
  const bool traced = stored && scene.estimator.text("cache").empty();
  plan.memory = predictedMemory(setup, traced);
  plan.memoryBudget = setup.memoryBudget;
  checkMemory(setup, traced);
  plan.notes = setup.notes;
  plan.seconds.read = setup.readSeconds;
  plan.seconds.rasterize = setup.rasterizeSeconds;
  predict(scene, request, setup, plan);
  StageSeconds& s = plan.seconds;
  // Set-up, which holds reading and rasterizing, is measured, not predicted; so is a light cache.
  const double cache = s.read - setup.readSeconds;
  s.total = setUp + cache + s.trace + s.resolve + s.march;
  return plan;
}

std::string planLine(std::span<const EffectState> effects) {
  std::vector<std::string> on, off;
  for (const EffectState& effect : effects)
    if (effect.on)
      on.push_back(effect.name);
    else
      off.push_back(fmt::format("{} ({})", effect.name, effect.why));
  return fmt::format("{}{}{}", on.empty() ? "nothing" : fmt::format("{}", fmt::join(on, ", ")),
                     off.empty() ? "" : "; off: ", fmt::join(off, ", "));
}

}  // namespace photosphere::scene
