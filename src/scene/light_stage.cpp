#include "light_stage.h"

#include <fmt/format.h>

#include "photosphere/core/frames.h"
#include "photosphere/core/hash.h"
#include "photosphere/core/resources.h"
#include "photosphere/estimators/light_cache.h"

namespace photosphere::scene {

namespace {

// What light in the cache came from: every lamp but its name, in local space.
std::string lightHash(const SceneFile& scene) {
  Hasher hasher;
  for (const LightEntry& light : scene.lights) {
    if (light.type == "environment" && scene.effects.text("environment") == "off") continue;
    hasher.text(light.type);
    for (const Param& row : light.values.rows())
      if (row.name != "name") {
        hasher.text(row.name);
        hasher.text(light.values.format(row.name));
      }
  }
  hasher.number(scene.scene.real("meters_per_unit"));
  return hasher.hex();
}

estimators::LightCacheKey cacheKey(const SceneFile& scene, const FrameSetup& setup) {
  return {setup.medium->hash(), lightHash(scene), setup.space};
}

// Keys that decided what a cache holds act no more once it is read.
void noteIdleKeys(const SceneFile& scene, FrameSetup& setup) {
  std::vector<std::string_view> idle;
  for (const std::string_view key :
       {"photons", "radius", "deposit_radius", "spatial_kernel", "carrier", "basis", "deposit",
        "rows", "energy", "light_voxel"})
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
      estimators::readLightCache(path, cacheKey(scene, setup), allowStale);
  setup.layout = field.layout;
  noteIdleKeys(scene, setup);
  statistics.photonsEmitted = field.photons;
  statistics.lightMemoryBytes = field.memoryBytes();
  statistics.seconds.read += watch.seconds();
  return field;
}

}  // namespace

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

estimators::LightField lightField(const SceneFile& scene, const RenderRequest& request,
                                  FrameSetup& setup, FrameStatistics& statistics) {
  if (!scene.estimator.text("cache").empty())
    return readField(scene, request.allowStale, setup, statistics);
  const Stopwatch watch;
  transport::TraceOptions options;
  options.photons = setup.photons;
  options.key = setup.key;
  transport::TraceStatistics traced;
  estimators::LightField field = estimators::traceLightField(
      *setup.medium, setup.lights, setup.layout, setup.view, setup.particles, options, traced);
  addTraced(traced, statistics);
  // Every flight after a scattering leaves light; the first one does where lamps with extent are
  // kept.
  statistics.photonsStored += setup.layout.unscattered ? traced.flights : traced.scatterings;
  statistics.lightMemoryBytes = field.memoryBytes();
  if (field.farPhotons > 0)
    setup.notes.push_back(fmt::format(
        "{} photons met no particle within the deposit radius and went to the nearest one",
        field.farPhotons));
  statistics.seconds.trace += watch.seconds();
  return field;
}

void storeLightField(const SceneFile& scene, const FrameSetup& setup,
                     const estimators::LightField& field, const std::string& path) {
  estimators::writeLightCache(path, field, cacheKey(scene, setup));
}

}  // namespace photosphere::scene
