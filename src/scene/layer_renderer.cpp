#include "layer_renderer.h"

#include <algorithm>
#include <cmath>

#include "light_stage.h"
#include "photosphere/core/resources.h"

namespace photosphere::scene {

namespace {

render::ShadowMode shadowMode(const std::string& name) {
  if (name == "march") return render::ShadowMode::march;
  if (name == "track") return render::ShadowMode::track;
  return render::ShadowMode::grid;
}

render::FilterKind filterKind(const std::string& name) {
  if (name == "box") return render::FilterKind::box;
  if (name == "triangle") return render::FilterKind::triangle;
  return render::FilterKind::blackmanHarris;
}

// What a path tracer or a light cache holds although the scene switched it off.
void dropLayers(const Effects& effects, render::FrameLayers& layers) {
  if (effects.singleScattering && effects.multipleScattering) return;
  if (!effects.singleScattering) layers.single.assign(layers.single.size(), Rgb(0.0f));
  render::setMultiple(layers, effects.multipleScattering
                                  ? std::move(layers.multiple)
                                  : std::vector<Rgb>(layers.multiple.size(), Rgb(0.0f)));
}

std::uint64_t shadowBudget(const FrameSetup& setup) {
  if (setup.memoryBudget == 0) return 0;
  const std::uint64_t used = setup.medium->memoryBytes();
  return setup.memoryBudget > used ? setup.memoryBudget - used : 1;
}

render::ShadowUse shadowUse(const FrameSetup& setup, int samples) {
  constexpr int kRays = 16;  // across, and down
  render::ShadowUse use;
  const Vec2d size(setup.camera->resolution());
  for (int y = 0; y < kRays; ++y)
    for (int x = 0; x < kRays; ++x) {
      use.seen.push_back(
          setup.camera->ray((Vec2d(x, y) + 0.5) / static_cast<double>(kRays) * size));
      use.seen.back().origin = setup.space.localFromWorld(use.seen.back().origin);
    }
  // A crop has the shadows of its frame, and so its pixels.
  use.rays = static_cast<std::uint64_t>(size.x * size.y) * static_cast<std::uint64_t>(samples);
  return use;
}

render::FrameOptions frameOptions(const SceneFile& scene, const render::Crop& crop,
                                  const FrameSetup& setup, bool paths) {
  render::FrameOptions options;
  const auto samples = static_cast<int>(paths ? scene.estimator.integer("samples")
                                              : scene.render.integer("samples"));
  options.samples = (samples + setup.batches - 1) / setup.batches;
  options.filter = filterKind(scene.render.text("filter"));
  options.filterWidth = scene.render.real("filter_width");
  options.crop = crop;
  options.space = setup.space;
  options.lens = setup.lens;
  options.moving = setup.medium->isMoving() || setup.motion;
  options.shutter = setup.medium->shutter();
  options.motion = setup.motion.get();
  return options;
}

// Paths of one truth that a frame's stored light is held against. Blocks are as many in every
// frame, so what they need does not grow with its pixels.
constexpr std::int64_t kTruthPaths = 150'000;

}  // namespace

bool sendsPaths(const SceneFile& scene) {
  const std::string& type = scene.estimator.text("type");
  return type == "path_traced" || type == "light_traced";
}

LayerRenderer::LayerRenderer(const SceneFile& scene, const render::Crop& crop,
                             const FrameSetup& setup)
    : m_setup(setup),
      m_paths(sendsPaths(scene)),
      m_options(frameOptions(scene, crop, setup, m_paths)) {
  if (m_paths) m_path.maxScatter = static_cast<int>(scene.estimator.integer("max_scatter"));
  m_path.effects = m_march.effects = setup.effects;
  if (setup.lightPaths) m_path.effects.multipleScattering = false;
  m_march.step = static_cast<float>(scene.render.real("step"));
  if (m_paths) return;
  if (storesLight(scene, setup))
    m_march.gatherRays = static_cast<int>(
        (scene.estimator.integer("final_gather") + m_options.samples - 1) / m_options.samples);
  const bool shadowed = setup.effects.singleScattering && setup.effects.shadows;
  const auto mode = shadowed || m_march.gatherRays > 0
                        ? shadowMode(scene.render.text("shadow"))
                        : render::ShadowMode::march;  // tabulates nothing
  m_shadows.emplace(*setup.medium, setup.lights, mode,
                    m_march.step * static_cast<float>(setup.medium->voxelEdge()),
                    shadowBudget(setup), shadowUse(setup, m_options.samples));
}

render::FrameLayers LayerRenderer::render(const estimators::InscatterSource* source, int pass,
                                          StateReader* begun, const PausePoint& pause) const {
  render::FrameOptions options = m_options;
  options.begun = begun;
  options.pause = pause;
  return render(source, pass, std::move(options));
}

render::LightPaths LayerRenderer::lightPaths(render::LightPathOptions options) const {
  options.filter = m_options.filter;
  options.filterWidth = m_options.filterWidth;
  options.crop = m_options.crop;
  options.space = m_options.space;
  options.lens = m_options.lens;
  options.maxScatter = m_path.maxScatter;
  return render::traceLightPaths(*m_setup.camera, *m_setup.medium, m_setup.lights, options);
}

std::vector<Rgb> LayerRenderer::lightPaths(Checkpoint* checkpoint, std::uint64_t part,
                                           FrameStatistics& statistics) const {
  const Stopwatch watch;
  render::LightPathOptions options;
  options.photons = m_setup.photons;
  options.key = m_setup.key;
  options.guide = m_setup.guide.get();
  options.checkpoint = checkpoint;
  options.part = part;
  render::LightPaths paths = lightPaths(options);
  addTraced(paths.traced, statistics);
  statistics.pathsCapped += paths.capped;
  statistics.pathsCappedRadiance += paths.cappedShare;
  statistics.seconds.trace += watch.seconds();
  return std::move(paths.multiple);
}

render::FrameLayers LayerRenderer::renderCrop(const estimators::InscatterSource* source, int pass,
                                              const render::Crop& crop) const {
  render::FrameOptions options = m_options;
  options.crop = crop;
  return render(source, pass, std::move(options));
}

render::FrameLayers LayerRenderer::render(const estimators::InscatterSource* source, int pass,
                                          render::FrameOptions options) const {
  options.key = m_setup.key;
  options.firstSample = pass * options.samples;
  const auto integrator = m_paths
                              ? render::makePathIntegrator(*m_setup.medium, m_setup.lights, m_path)
                              : render::makeMarchIntegrator(*m_setup.medium, m_setup.lights,
                                                            *m_shadows, source, m_march);
  render::FrameLayers layers = render::renderFrame(*m_setup.camera, *integrator, options);
  dropLayers(m_setup.effects, layers);
  return layers;
}

Truth LayerRenderer::truth(RandomKey key, bool fromLamps) const {
  render::FrameOptions options = m_options;
  const Vec2i size = options.crop.max - options.crop.min;
  const std::int64_t pixels = std::max<std::int64_t>(1, std::int64_t{size.x} * size.y);
  options.samples = static_cast<int>(std::clamp<std::int64_t>(kTruthPaths / pixels, 1, 64));
  options.key = key;
  render::PathOptions path = m_path;
  if (fromLamps) path.effects.multipleScattering = false;
  const auto integrator = render::makePathIntegrator(*m_setup.medium, m_setup.lights, path);
  render::FrameLayers layers = render::renderFrame(*m_setup.camera, *integrator, options);
  Truth truth;
  if (fromLamps) {
    render::LightPathOptions paths;
    paths.photons = static_cast<std::uint64_t>(options.samples * pixels);
    paths.key = key;
    render::LightPaths lamps = lightPaths(paths);
    truth.joined = lamps.joined;
    render::setMultiple(layers, std::move(lamps.multiple));
  }
  dropLayers(m_setup.effects, layers);
  truth.beauty = std::move(layers.beauty);
  return truth;
}

double LayerRenderer::rays(const render::Crop& crop) const {
  const double radius = render::PixelFilter(m_options.filter, m_options.filterWidth).radius();
  const double border = 2 * std::ceil(radius - 0.5);
  const Vec2d size(crop.max - crop.min);
  return (size.x + border) * (size.y + border) * m_options.samples;
}

}  // namespace photosphere::scene
