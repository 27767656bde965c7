#include "light_stage.h"

#include <fmt/format.h>

#include <tuple>

#include "light_notes.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/hash.h"
#include "photosphere/core/resources.h"
#include "photosphere/estimators/light_cache.h"

namespace photosphere::scene {

namespace {

// What light in the cache came from: every lamp but its name, in local space.
std::string lightHash(const SceneFile& scene, const FrameSetup& setup) {
  Hasher hasher;
  for (const auto& light : setup.lights)
    light->addContent(hasher);
  for (const LightEntry& light : scene.lights) {
    if (light.type == "environment" && scene.effects.text("environment") == "off") continue;
    hasher.text(light.type);
    for (const Param& row : light.values.rows())
      if (row.name != "name" && row.name != "file") {
        hasher.text(row.name);
        hasher.text(light.values.format(row.name));
      }
  }
  hasher.number(scene.scene.real("meters_per_unit"));
  return hasher.hex();
}

// Keys that decided what a cache holds act no more once it is read.
void noteIdleKeys(const SceneFile& scene, FrameSetup& setup) {
  std::vector<std::string_view> idle;
  for (const std::string_view key :
       {"photons", "radius", "deposit_radius", "spatial_kernel", "carrier", "basis", "deposit",
        "rows", "order", "energy", "direction", "representative", "light_voxel"})
    if (scene.estimator.given(key)) idle.push_back(key);
  if (!idle.empty())
    setup.notes.push_back(
        fmt::format("estimator.cache decides what was stored; {} in the scene {} not act (trace "
                    "again to change "
                    "that)",
                    fmt::join(idle, ", "), idle.size() == 1 ? "does" : "do"));
}

estimators::LightField readField(const SceneFile& scene, bool allowStale, FrameSetup& setup,
                                 FrameStatistics& statistics) {
  const Stopwatch watch;
  const std::string path = framePath(scene.resolvePath(scene.estimator.text("cache")), setup.frame);
  estimators::LightField field =
      estimators::readLightCache(path, lightKey(scene, setup), allowStale);
  // How light is read is the scene's to say; kernel and bandwidth were used up where they spread
  // it.
  estimators::LightFieldLayout& layout = field.layout;
  if (scene.estimator.given("smoothing") || layout.smoothing != estimators::Smoothing::visible)
    layout.smoothing = setup.layout.smoothing;
  layout.merge = setup.layout.merge;
  layout.evaluate = setup.layout.evaluate;
  layout.nearEye = setup.layout.nearEye;
  layout.directions = setup.layout.directions;
  if (layout.direction != sphere::DirectionDeposit::kernel) {
    layout.angularKernel = setup.layout.angularKernel;
    layout.bandwidth = setup.layout.bandwidth;
    layout.truncation = setup.layout.truncation;
  }
  try {
    estimators::checkLayout(layout);
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("[estimator] with the light cache {}: {}", path, error.what()));
  }
  setup.layout = layout;
  noteIdleKeys(scene, setup);
  noteCoarseDirections(setup);
  statistics.photonsEmitted = field.photons;
  statistics.lightMemoryBytes = field.memoryBytes();
  statistics.seconds.read += watch.seconds();
  return field;
}

}  // namespace

std::uint64_t storedPhotons(const estimators::LightFieldLayout& layout,
                            const transport::TraceStatistics& traced) {
  return layout.unscattered ? traced.flights : traced.scatterings + traced.born;
}

void addTraced(const transport::TraceStatistics& traced, FrameStatistics& s) {
  s.photonsEmitted += traced.photons;
  s.photonsScattered += traced.scatterings;
  s.photonsCapped += traced.capped;
  s.majorantViolations += traced.majorantViolations;
  s.energyEmitted += traced.emitted;
  s.energyMissed += traced.missed;
  s.energyAbsorbed += traced.absorbed;
  s.energyEscaped += traced.escaped;
  s.energyCapped += traced.cappedPower;
  s.energyError += traced.imbalance();
}

estimators::LightCacheKey lightKey(const SceneFile& scene, const FrameSetup& setup) {
  return {setup.medium->hash(), lightHash(scene, setup), setup.space};
}

estimators::LightSums lightSums(const RenderRequest& request, FrameSetup& setup,
                                FrameStatistics& statistics, transport::TraceStatistics& traced,
                                std::uint64_t part) {
  const Stopwatch watch;
  transport::TraceOptions options;
  options.photons = setup.photons;
  options.key = setup.key;
  options.guide = setup.guide.get();
  if (request.shard)
    std::tie(options.firstPhoton, options.photonCount) =
        estimators::photonsOf(*request.shard, setup.photons);
  estimators::LightSums light = estimators::traceLightSums(
      *setup.medium, setup.lights, setup.layout, setup.view, setup.particles, options, traced,
      setup.visibleWeights, request.checkpoint, part);
  setup.visibleWeights = light.weights;
  addTraced(traced, statistics);
  statistics.photonsStored += storedPhotons(setup.layout, traced);
  if (light.farPhotons > 0)
    setup.notes.push_back(fmt::format(
        "{} photons met no particle within the deposit radius and went to the nearest one",
        light.farPhotons));
  statistics.seconds.trace += watch.seconds();
  return light;
}

estimators::LightField lightField(const SceneFile& scene, const RenderRequest& request,
                                  FrameSetup& setup, FrameStatistics& statistics,
                                  std::uint64_t part) {
  if (!scene.estimator.text("cache").empty())
    return readField(scene, request.allowStale, setup, statistics);
  transport::TraceStatistics traced;
  estimators::LightSums light = lightSums(request, setup, statistics, traced, part);
  const Stopwatch watch;
  estimators::LightField field = estimators::toField(std::move(light));
  statistics.lightMemoryBytes = field.memoryBytes();
  statistics.seconds.trace += watch.seconds();
  return field;
}

}  // namespace photosphere::scene
