#include "photosphere/scene/frame_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "camera_setup.h"
#include "effect_plan.h"
#include "light_layout.h"
#include "light_notes.h"
#include "light_setup.h"
#include "medium_setup.h"
#include "photon_map_stage.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/resources.h"
#include "photosphere/core/rng.h"
#include "photosphere/scene/plan.h"
#include "unseen_volumes.h"

namespace photosphere::scene {

namespace {

// Independent parts of a frame whose error is estimated: the relative standard error of a variance
// from eight is about a half, but the mean of it over pixels is far better.
constexpr int kErrorBatches = 8;

std::uint64_t memoryBudget(const SceneFile& scene) {
  const double limit = scene.render.real("memory_limit");
  if (limit < 0) return 0;
  const double bytes = limit > 0 ? limit * 1024.0 * 1024.0 * 1024.0
                                 : 0.85 * static_cast<double>(availableMemoryBytes());
  return static_cast<std::uint64_t>(std::max(1.0, std::min(bytes, 9e18)));
}

// Keyed values as they are at the frame, and the resolution that is asked for.
SceneFile sceneOfFrame(const SceneFile& written, std::int64_t frame, const SetupOptions& options) {
  SceneFile scene = written;
  if (options.resolution)
    scene.camera.set("resolution",
                     std::vector<double>{static_cast<double>(options.resolution->x),
                                         static_cast<double>(options.resolution->y)},
                     scene.cameraWhere);
  scene = sceneAt(scene, static_cast<double>(frame));
  const Vec2d shutter = scene.camera.vec2("shutter");
  if (shutter.y < shutter.x)
    throw ConfigError(fmt::format("{}: 'shutter' closes at {}, before it opens at {}",
                                  scene.cameraWhere, shutter.y, shutter.x));
  return scene;
}

// Of light that this frame stores itself; what a cache holds is known when it is read.
void noteCoarseLight(const SceneFile& scene, FrameSetup& setup) {
  if (scene.estimator.text("type") != "photosphere" || !scene.estimator.text("cache").empty() ||
      !setup.effects.multipleScattering || setup.medium->bounds().empty())
    return;
  noteCoarseDirections(setup);
  noteEyeInSmoke(setup);
  noteFewCarriers(setup);
}

// As many as a path tracer would send from the eye.
std::int64_t lightPaths(const SceneFile& scene, const FrameSetup& setup) {
  if (setup.medium->isMoving() || setup.motion)
    throw ConfigError(
        "estimator.type = \"light_traced\" joins photons to a camera at rest in smoke at rest; set "
        "effects.motion_blur = \"off\", or use \"path_traced\"");
  const Vec2i size = setup.camera->resolution();
  return scene.estimator.integer("samples") * size.x * size.y;
}

// Distance of the smoke from the middle of local space, in voxels, beyond which positions of
// floats would be off by more than a thousandth of one.
constexpr double kFarVoxels = 1e4;

bool isOffCenter(const FrameSetup& setup) {
  const Box3d& box = setup.medium->bounds();
  return !box.empty() &&
         glm::length(box.center()) >
             std::max(kFarVoxels * setup.medium->voxelEdge(), glm::length(box.extent()));
}

// Whether the camera sees none of the smoke.
bool isOutOfView(const SceneFile& scene, const FrameSetup& setup) {
  const Box3d& box = setup.medium->bounds();
  return box.empty() || isUnseen(scene, setup, box);
}

SceneFile withStrays(SceneFile scene) {
  for (VolumeEntry& volume : scene.volumes)
    volume.values.set("strays", std::string("keep"), volume.where);
  return scene;
}

// @param center  of local space, world space; nothing = the middle of all smoke
FrameSetup setUpAbout(const std::optional<Vec3d>& center, const SceneFile& scene,
                      std::int64_t frame, const SetupOptions& options) {
  FrameSetup setup;
  setup.path = scene.path.empty() && !scene.volumes.empty()
                   ? scene.volumes.front().values.text("file")
                   : scene.path;
  setup.frame = frame;
  setup.memoryBudget = memoryBudget(scene);
  const bool particles = scene.estimator.text("type") == "photosphere" &&
                         scene.estimator.text("carrier") == "particles";
  buildMedium(scene, options.cacheFrame.value_or(frame), particles, center, setup);
  buildLights(scene, setup);
  buildCamera(scene, setup);
  planEffects(scene, options.forLightCache || !scene.estimator.text("cache").empty(), setup);
  viewFromTheMiddle(setup);
  chooseLayout(scene, options.forLightCache, setup);
  noteCoarseLight(scene, setup);
  const std::int64_t seed = options.seed.value_or(scene.scene.integer("seed"));
  setup.key = RandomKey::fromSeed(static_cast<std::uint64_t>(seed),
                                  scene.scene.flag("seed_per_frame") ? frame : 0);
  // Stored light is of all photons: none of its parts is judged.
  if (!options.forLightCache &&
      (scene.render.real("target_error") > 0 || scene.render.real("time_limit") > 0))
    setup.batches = kErrorBatches;
  setup.lightPaths =
      scene.estimator.text("type") == "light_traced" && setup.effects.multipleScattering;
  const auto photons = static_cast<std::uint64_t>(
      setup.lightPaths ? lightPaths(scene, setup) : scene.estimator.integer("photons"));
  const auto batches = static_cast<std::uint64_t>(setup.batches);
  setup.photons = (photons + batches - 1) / batches;
  planPhotonMap(scene, setup);
  return setup;
}

}  // namespace

FrameSetup setUpFrame(const SceneFile& written, std::int64_t frame, const SetupOptions& options) {
  const SceneFile scene = sceneOfFrame(written, frame, options);
  FrameSetup setup = setUpAbout({}, scene, frame, options);
  const bool onlyStraysSeen = setup.leftStrays && isOutOfView(scene, setup);
  if (!onlyStraysSeen && !isOffCenter(setup)) return setup;
  const double read = setup.readSeconds, rasterize = setup.rasterizeSeconds;
  // What was left out as unseen lay far from the rest.
  std::optional<Vec3d> center;
  if (!onlyStraysSeen) center = setup.worldBounds.center();
  setup = {};  // there may be no room for two
  setup = setUpAbout(center, onlyStraysSeen ? withStrays(scene) : scene, frame, options);
  setup.readSeconds += read;
  setup.rasterizeSeconds += rasterize;
  return setup;
}

bool storesLight(const SceneFile& scene, const FrameSetup& setup) {
  const std::string& type = scene.estimator.text("type");
  return (type == "photosphere" || type == "photon_map") && setup.effects.multipleScattering;
}

std::uint64_t predictedLightBytes(const FrameSetup& setup) {
  if (setup.photonMap) return estimators::photonMapBytes(*setup.photonMap, setup.photonMapPhotons);
  const estimators::LightFieldLayout& l = setup.layout;
  const auto values = static_cast<std::uint64_t>(l.valuesPerCarrier());
  // Per step the floats are sharpened, which takes as many again.
  const bool perStep = l.evaluate == estimators::Evaluate::perStep;
  const std::uint64_t bytesEach = sizeof(std::int64_t) + sizeof(float) * (perStep ? 2 : 1);
  const transport::Medium& medium = *setup.medium;
  if (medium.bounds().empty()) return 0;
  std::uint64_t bytes = estimators::nearEyeBytes(medium, l, setup.view);
  if (l.carrier == estimators::Carrier::particles)
    bytes += setup.particles.size() * values * bytesEach;
  if (l.holdsPower()) return bytes;
  const double edge = l.lightVoxel * medium.voxelEdge();
  const int margin = static_cast<int>(std::ceil(l.radius / edge)) + 1;
  // A full box is an upper bound that costs nothing; only a large one is worth counting exactly.
  const Vec3d cells = glm::ceil(medium.bounds().extent() / edge) + 2.0 * margin + 8.0;
  const double perVoxel = static_cast<double>(values * bytesEach);
  const double most = cells.x * cells.y * cells.z * perVoxel;
  if (setup.memoryBudget == 0 || most < 0.5 * static_cast<double>(setup.memoryBudget))
    return bytes + static_cast<std::uint64_t>(most);
  return bytes + transport::SupportLattice(medium, edge, margin).size() * values * bytesEach;
}

FrameMemory predictedMemory(const FrameSetup& setup, bool storedLight) {
  FrameMemory memory;
  memory.smoke = setup.medium->memoryBytes();
  memory.light = storedLight ? predictedLightBytes(setup) : 0;
  const Vec2i size = setup.camera->resolution();
  const std::uint64_t frames =
      setup.batches > 1 || (setup.photonMap && setup.photonMap->passes > 1) ? 3 : 1;
  memory.pixels = static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y) *
                  (frames * (6 * sizeof(Rgb) + 2 * sizeof(float)) +
                   (setup.lightPaths ? sizeof(Rgb) + 3 * sizeof(std::int64_t) : 0));
  return memory;
}

void checkMemory(const FrameSetup& setup, bool storedLight) {
  if (setup.memoryBudget == 0) return;
  const FrameMemory memory = predictedMemory(setup, storedLight);
  if (memory.total() <= setup.memoryBudget) return;
  const std::string_view less =
      setup.photonMap
          ? "Lower estimator.photons (with estimator.passes, as many photons in less memory)"
          : "Raise estimator.light_voxel, lower estimator.rows (a histogram has 8 * rows^2 bins; "
            "basis = \"view\" has one)";
  throw MemoryError(fmt::format(
      "{}: frame {} needs about {}: {} for the smoke, {} for stored light, {} for pixels; the "
      "budget is {}. {}, lower the resolution, or raise render.memory_limit (-1 = none)",
      setup.path, setup.frame, formatBytes(memory.total()), formatBytes(memory.smoke),
      formatBytes(memory.light), formatBytes(memory.pixels), formatBytes(setup.memoryBudget),
      less));
}

}  // namespace photosphere::scene
