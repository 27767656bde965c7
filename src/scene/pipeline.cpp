#include "photosphere/scene/pipeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "aim.h"
#include "black_frame.h"
#include "frame_batches.h"
#include "light_stage.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/hash.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"
#include "photosphere/core/version.h"

namespace photosphere::scene {

namespace {

render::Crop clippedCrop(const std::optional<render::Crop>& wished, const Vec2i& resolution) {
  if (!wished) return {Vec2i(0), resolution};
  const render::Crop crop{glm::max(wished->min, Vec2i(0)), glm::min(wished->max, resolution)};
  if (crop.max.x <= crop.min.x || crop.max.y <= crop.min.y)
    throw ConfigError(fmt::format("the crop lies outside the frame of {} x {} pixels", resolution.x,
                                  resolution.y));
  return crop;
}

void checkSamples(const render::FrameLayers& layers) {
  if (layers.nanSamples == 0 && layers.negativeSamples == 0) return;
  throw SampleError(
      fmt::format("{} samples are NaN or infinite and {} negative, the first in pixel "
                  "({}, {}); the frame is not written. Light of 1e25 and more leaves what a float "
                  "holds where smoke or the camera is close to its lamp: lower `intensity`, or "
                  "`emission.scale`. Anything else is a defect: please report it with the scene",
                  layers.nanSamples, layers.negativeSamples, layers.firstBad.x, layers.firstBad.y),
      layers.nanSamples, layers.negativeSamples);
}

void measureImage(const render::FrameLayers& layers, FrameStatistics& statistics) {
  double sum = 0, most = 0;
  for (const Rgb& pixel : layers.beauty)
    for (int c = 0; c < 3; ++c) {
      sum += static_cast<double>(pixel[c]);
      most = std::max(most, static_cast<double>(pixel[c]));
    }
  const auto count = static_cast<double>(std::max<std::size_t>(1, 3 * layers.beauty.size()));
  statistics.imageMean = sum / count;
  statistics.imageMax = most;
}

std::vector<std::string> presentLayers(const FrameSetup& setup) {
  std::vector<std::string> names{"beauty"};
  if (setup.effects.singleScattering) names.emplace_back("single");
  if (setup.effects.multipleScattering) names.emplace_back("multiple");
  if (setup.effects.emission) names.emplace_back("emission");
  if (setup.effects.environment) names.emplace_back("background");
  names.emplace_back("transmittance");
  names.emplace_back("depth");
  return names;
}

void finish(const FrameSetup& setup, double cpuBefore, FrameResult& result) {
  FrameStatistics& s = result.statistics;
  const render::FrameLayers& layers = result.layers;
  s.nanSamples = layers.nanSamples;
  s.negativeSamples = layers.negativeSamples;
  s.majorantViolations += layers.counters.tracking.majorantViolations;
  s.pathsCapped += layers.counters.capped;
  s.pathsCappedRadiance += layers.counters.cappedRadiance;
  if (s.pathsCapped > 0)
    result.notes.push_back(
        fmt::format("estimator.max_scatter ended {} paths, which lose {:.4g} of "
                    "throughput in all",
                    s.pathsCapped, s.pathsCappedRadiance));
  if (s.majorantViolations > 0)
    result.notes.push_back(fmt::format(
        "{} lookups exceeded their majorant: the frame is biased there", s.majorantViolations));
  s.effects = setup.effectStates;
  measureImage(layers, s);
  s.cpuSeconds = processCpuSeconds() - cpuBefore;
  s.peakMemoryBytes = peakMemoryBytes();
}

SetupOptions setupOptions(const RenderRequest& request) {
  SetupOptions options;
  options.resolution = request.resolution;
  options.seed = request.seed;
  options.cacheFrame = request.cacheFrame;
  return options;
}

// Names the work for its checkpoint: all that its result depends on.
std::string workOf(std::string_view what, const SceneFile& scene, const FrameSetup& setup,
                   const RenderRequest& request, const render::Crop& crop) {
  Hasher hasher;
  hasher.text(buildText());
  hasher.text(what);
  hasher.text(scene.hash());
  const estimators::LightCacheKey key = lightKey(scene, setup);
  hasher.text(key.mediumHash);
  hasher.text(key.lightHash);
  for (const std::int64_t number :
       {setup.frame, request.cacheFrame.value_or(setup.frame),
        static_cast<std::int64_t>(setup.key.lo), static_cast<std::int64_t>(setup.key.hi)})
    hasher.number(number);
  const Vec2i size = setup.camera->resolution();
  for (const int number : {size.x, size.y, crop.min.x, crop.min.y, crop.max.x, crop.max.y})
    hasher.number(number);
  const estimators::ShardNumber shard = request.shard.value_or(estimators::ShardNumber{});
  hasher.number(shard.index);
  hasher.number(shard.count);
  if (const std::string& cache = scene.estimator.text("cache"); !cache.empty()) {
    const std::filesystem::path path = framePath(scene.resolvePath(cache), setup.frame);
    std::error_code error;
    hasher.number(static_cast<std::uint64_t>(std::filesystem::file_size(path, error)));
    hasher.number(std::filesystem::last_write_time(path, error).time_since_epoch().count());
  }
  return hasher.hex();
}

void startStatistics(const SceneFile& scene, const FrameSetup& setup, FrameStatistics& s) {
  s.seconds.read = setup.readSeconds;
  s.seconds.rasterize = setup.rasterizeSeconds;
  s.sceneHash = scene.hash();
  s.mediumHash = setup.medium->hash();
}

}  // namespace

FrameResult renderScene(const SceneFile& written, std::int64_t frame,
                        const RenderRequest& request) {
  const Stopwatch total;
  const double cpuBefore = processCpuSeconds();
  const SceneFile scene = sceneAt(written, static_cast<double>(frame));
  FrameSetup setup = setUpFrame(scene, frame, setupOptions(request));
  const render::Crop crop = clippedCrop(request.crop, setup.camera->resolution());
  FrameResult result;
  result.frame = frame;
  startStatistics(scene, setup, result.statistics);
  result.layerNames = presentLayers(setup);
  result.cameraFromWorld = setup.camera->cameraFromWorld();
  result.ndcFromWorld = setup.camera->ndcFromWorld();
  result.framesPerSecond = scene.scene.real("fps");
  result.estimator = scene.estimator.text("type");
  result.seed = request.seed.value_or(scene.scene.integer("seed"));

  if (request.checkpoint)
    request.checkpoint->identify(workOf("render", scene, setup, request, crop));
  const Stopwatch aiming;
  aimLight(scene, crop, setup);
  if (setup.guide) result.statistics.seconds.trace += aiming.seconds();
  checkMemory(setup, storesLight(scene, setup) && scene.estimator.text("cache").empty());
  renderBatches(scene, request, crop, total, setup, result);
  result.notes = setup.notes;
  finish(setup, cpuBefore, result);
  checkSamples(result.layers);
  // Without volumes the frame is asked for without smoke.
  if (!scene.volumes.empty() && isBlack(result.layers))
    result.warnings.push_back("the frame is black: " + whyBlack(scene, setup, result.layers));
  result.statistics.seconds.total += total.seconds();
  return result;
}

FrameStatistics traceScene(const SceneFile& written, std::int64_t frame, const std::string& output,
                           const RenderRequest& request) {
  const SceneFile scene = sceneAt(written, static_cast<double>(frame));
  if (scene.estimator.text("type") != "photosphere")
    throw ConfigError(
        fmt::format("estimator.type = \"{}\" has no light cache; tracing one needs \"photosphere\"",
                    scene.estimator.text("type")));
  if (!scene.estimator.text("cache").empty())
    throw ConfigError(
        "estimator.cache is set: the light was traced already; remove it to trace anew");
  if (scene.estimator.text("basis") == "view")
    throw ConfigError(
        "estimator.basis = \"view\" holds light for one camera and cannot be cached; use "
        "\"histogram\", \"spherical_harmonics\" or \"auto\"");
  const Stopwatch total;
  const double cpuBefore = processCpuSeconds();
  SetupOptions options = setupOptions(request);
  options.forLightCache = true;
  FrameSetup setup = setUpFrame(scene, frame, options);
  FrameStatistics statistics;
  startStatistics(scene, setup, statistics);
  checkMemory(setup, true);
  if (request.checkpoint) request.checkpoint->identify(workOf("trace", scene, setup, request, {}));
  transport::TraceStatistics traced;
  estimators::LightSums light = lightSums(request, setup, statistics, traced);
  for (const std::string& note : setup.notes)
    log::info("frame {}: {}", frame, note);
  const std::string path = framePath(output, frame);
  const Stopwatch writing;
  const InterruptDelay delay;  // what is traced is written
  if (request.shard)
    estimators::writeLightShard(
        path, {*request.shard, std::move(light), lightKey(scene, setup),
               fmt::format("{:08x}{:08x}", setup.key.hi, setup.key.lo), buildText(), traced});
  else
    estimators::writeLightCache(path, estimators::toField(std::move(light)),
                                lightKey(scene, setup));
  statistics.seconds.write = writing.seconds();
  statistics.effects = setup.effectStates;
  statistics.cpuSeconds = processCpuSeconds() - cpuBefore;
  statistics.peakMemoryBytes = peakMemoryBytes();
  statistics.seconds.total = total.seconds();
  return statistics;
}

FrameStatistics mergeShards(const std::vector<std::filesystem::path>& shards,
                            const std::string& output, std::vector<std::string>& notes) {
  const Stopwatch total;
  const double cpuBefore = processCpuSeconds();
  FrameStatistics statistics;
  estimators::MergedLight merged = estimators::mergeLightShards(shards);
  notes = merged.notes;
  addTraced(merged.statistics, statistics);
  statistics.photonsStored = storedPhotons(merged.field.layout, merged.statistics);
  statistics.lightMemoryBytes = merged.field.memoryBytes();
  statistics.mediumHash = merged.key.mediumHash;
  const Stopwatch writing;
  estimators::writeLightCache(output, merged.field, merged.key);
  statistics.seconds.write = writing.seconds();
  statistics.seconds.total = total.seconds();
  statistics.cpuSeconds = processCpuSeconds() - cpuBefore;
  statistics.peakMemoryBytes = peakMemoryBytes();
  return statistics;
}

std::vector<std::int64_t> sceneFrames(const SceneFile& scene) {
  const std::string& frames = scene.scene.text("frames");
  return frames.empty() ? std::vector<std::int64_t>{1} : parseFrames(frames);
}

}  // namespace photosphere::scene
