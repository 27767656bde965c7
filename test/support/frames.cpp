#include "support/frames.h"

#include "photosphere/core/registry.h"
#include "photosphere/core/resources.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

render::FrameOptions frameOptions(const TestScene& scene, int samples, std::uint64_t seed) {
  render::FrameOptions options;
  options.samples = samples;
  options.crop = {Vec2i(0), scene.camera->resolution()};
  options.key = RandomKey::fromSeed(seed, 0);
  options.moving = scene.medium->isMoving();
  options.shutter = scene.medium->shutter();
  return options;
}

// Marches a source that is ready.
void marchFrame(const TestScene& scene, const estimators::InscatterSource& source,
                std::uint64_t seed, int samples, int gatherRays, PhotosphereFrame& frame) {
  const Stopwatch shadowWatch;
  const auto edge = static_cast<float>(scene.medium->voxelEdge());
  const render::Shadows shadows(*scene.medium, scene.lights, render::ShadowMode::grid, edge, 0);
  frame.resolveSeconds += shadowWatch.seconds();
  const Stopwatch march;
  render::MarchOptions marching;
  marching.gatherRays = gatherRays;
  const auto integrator =
      render::makeMarchIntegrator(*scene.medium, scene.lights, shadows, &source, marching);
  frame.layers =
      render::renderFrame(*scene.camera, *integrator, frameOptions(scene, samples, seed + 1000));
  frame.marchSeconds = march.seconds();
}

std::vector<float> plane(const std::vector<Rgb>& image, int channel) {
  std::vector<float> values;
  values.reserve(image.size());
  for (const Rgb& c : image)
    values.push_back(c[channel]);
  return values;
}

}  // namespace

estimators::View TestScene::view() const {
  estimators::View v;
  v.hasEye = camera->hasEye();
  v.eye = camera->position();
  v.direction = Vec3f(camera->viewDirection());
  return v;
}

std::unique_ptr<cameras::Camera> perspectiveCamera(const Vec3d& eye, double fov, int pixels) {
  const auto& plugin = findPlugin(cameras::cameraModels(), "perspective", "camera", "test");
  ParamValues values(plugin.params);
  values.set("fov", fov, "test");
  return plugin.create(values, cameras::lookAt(eye, Vec3d(0.0), Vec3d(0, 0, 1)), Vec2i(pixels));
}

TestScene sphereScene(double tau, double albedo, double g, int cells, int pixels) {
  TestScene scene;
  const double voxel = 1.1 / cells;
  scene.medium = std::make_unique<transport::Medium>(
      makeMedium(sampledVolume(1.1, cells, {albedo, g, tau}, [&](const Vec3d& p) {
        // A ramp one voxel wide, so that the lattice represents the sphere.
        return glm::clamp((0.5 - glm::length(p)) / voxel + 0.5, 0.0, 1.0);
      })));
  scene.lights.push_back(makeLight("spot", {{"position", "[2.5, -1.5, 2]"},
                                            {"target", "[0, 0, 0]"},
                                            {"intensity", "40"},
                                            {"cone_angle", "12"},
                                            {"cone_edge", "3"}}));
  scene.camera = perspectiveCamera({0, -3.2, 0.6}, 24, pixels);
  return scene;
}

TestScene plumeScene(double g, int cells, int pixels) {
  return plumeScene(sampledVolume(1.0, cells, {0.95, g, 30.0}, plumeDensity), pixels);
}

TestScene plumeScene(transport::MediumVolume smoke, int pixels) {
  TestScene scene;
  scene.medium = std::make_unique<transport::Medium>(makeMedium(std::move(smoke)));
  scene.lights.push_back(makeLight("spot", {{"position", "[2, -1, 2]"},
                                            {"target", "[0, 0, 0.1]"},
                                            {"intensity", "30"},
                                            {"cone_angle", "8"},
                                            {"cone_edge", "2"}}));
  scene.camera = perspectiveCamera({0, -3, 0.4}, 22, pixels);
  return scene;
}

std::vector<Vec3f> seedParticles(const transport::Medium& medium, std::size_t count) {
  std::vector<Vec3f> particles;
  Rng rng(RandomKey::fromSeed(3, 0), RandomStream::particles, 0);
  const Vec3f low(medium.bounds().min), extent(medium.bounds().extent());
  const float largest = medium.majorants().maximum();
  while (particles.size() < count) {
    const Vec3f p = low + extent * Vec3f(rng.uniform(), rng.uniform(), rng.uniform());
    if (rng.uniform() * largest < medium.extinction(p)) particles.push_back(p);
  }
  return particles;
}

render::FrameLayers renderPath(const TestScene& scene, int samples, std::uint64_t seed) {
  const auto path = render::makePathIntegrator(*scene.medium, scene.lights, {});
  samples = static_cast<int>(fewer(static_cast<std::uint64_t>(samples)));
  return render::renderFrame(*scene.camera, *path, frameOptions(scene, samples, seed));
}

PhotosphereFrame renderPhotosphere(const TestScene& scene, estimators::LightFieldLayout layout,
                                   std::uint64_t photons, std::uint64_t seed, int samples,
                                   int gatherRays) {
  PhotosphereFrame frame;
  photons = fewer(photons);
  layout.phases = static_cast<int>(scene.medium->phases().size());
  if (layout.radius == 0) layout.radius = automaticRadius(*scene.medium, layout, photons);
  if (layout.depositRadius == 0) layout.depositRadius = layout.radius;
  transport::TraceOptions options;
  options.photons = photons;
  options.key = RandomKey::fromSeed(seed, 0);
  Stopwatch trace;
  const estimators::LightField field =
      estimators::traceLightField(*scene.medium, scene.lights, layout, scene.view(),
                                  scene.particles, options, frame.statistics);
  frame.traceSeconds = trace.seconds();
  Stopwatch resolveWatch;
  const auto source = estimators::resolve(*scene.medium, field, scene.view(), options.key);
  frame.negativeShare = source->negativeShare();
  frame.resolveSeconds = resolveWatch.seconds();
  marchFrame(scene, *source, seed, samples, gatherRays, frame);
  return frame;
}

PhotosphereFrame renderPhotonMap(const TestScene& scene, estimators::PhotonMapLayout layout,
                                 std::uint64_t photons, std::uint64_t seed, int samples) {
  PhotosphereFrame frame;
  photons = fewer(photons);
  transport::TraceOptions options;
  options.photons = photons;
  options.key = RandomKey::fromSeed(seed, 0);
  if (layout.radius == 0)
    layout.radius = estimators::automaticRadius(
        *scene.medium,
        estimators::forecastPhotons(*scene.medium, scene.lights, layout.unscattered, options));
  const Stopwatch trace;
  const auto map =
      estimators::tracePhotonMap(*scene.medium, scene.lights, layout, options, frame.statistics);
  frame.traceSeconds = trace.seconds();
  marchFrame(scene, *map, seed, samples, 0, frame);
  return frame;
}

BlockDeviation deviationFromOne(const std::vector<Rgb>& image, int width, int block) {
  const int height = static_cast<int>(image.size()) / width;
  BlockDeviation off;
  for (int by = 0; by < height; by += block)
    for (int bx = 0; bx < width; bx += block) {
      double sum = 0;
      for (int y = by; y < by + block; ++y)
        for (int x = bx; x < bx + block; ++x)
          sum += static_cast<double>(image[static_cast<std::size_t>(y * width + x)].y);
      off.mean += sum / static_cast<double>(image.size());
      off.worst = std::max(off.worst, std::abs(sum / (block * block) - 1));
    }
  return off;
}

Truth pathTruth(const TestScene& scene, int samples, std::uint64_t firstSeed) {
  return {renderPath(scene, samples, firstSeed), renderPath(scene, samples, firstSeed + 1)};
}

LayerError Truth::errorOf(const render::FrameLayers& frame, Layer layer) const {
  std::vector<std::vector<float>> planes, references, variances;
  for (int c = 0; c < 3; ++c) {
    planes.push_back(plane(frame.*layer, c));
    const auto first = plane(a.*layer, c), second = plane(b.*layer, c);
    std::vector<float> mean(first.size());
    for (std::size_t i = 0; i < first.size(); ++i)
      mean[i] = 0.5f * (first[i] + second[i]);
    references.push_back(std::move(mean));
    variances.push_back(image::varianceOfMean(first, second));
  }
  image::MeasureOptions options;
  for (const auto& v : variances)
    options.referenceVariance.emplace_back(v);
  std::vector<std::span<const float>> x(planes.begin(), planes.end()),
      r(references.begin(), references.end());
  const image::ErrorMetrics all = image::measure(x, r, frame.width(), Vec2i(0), options);
  std::vector<unsigned char> mask;
  for (const Rgb& t : a.transmittance)
    mask.push_back(meanComponent(t) < 0.99f);
  options.mask = mask;
  const image::ErrorMetrics smoke = image::measure(x, r, frame.width(), Vec2i(0), options);
  return {all.unbiasedRelMse, smoke.unbiasedRelMse, all.meanRatio, all.referenceNoise};
}

}  // namespace photosphere::test
