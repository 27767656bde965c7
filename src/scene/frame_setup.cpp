#include "photosphere/scene/frame_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "camera_setup.h"
#include "effect_plan.h"
#include "estimator_options.h"
#include "light_notes.h"
#include "light_setup.h"
#include "medium_setup.h"
#include "photon_map_stage.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/resources.h"
#include "photosphere/core/rng.h"
#include "photosphere/scene/plan.h"
#include "photosphere/volume/rasterize.h"
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

// Nearest-neighbour spacing of the carriers [m].
double carrierSpacing(const std::vector<Vec3f>& particles) {
  volume::ParticleSet set;
  set.positions.assign(particles.begin(), particles.end());
  return set.size() > 1 ? volume::medianSpacing(set) : 0.0;
}

// |g| of the sharpest lobe from where on a photon that happens to fly toward the eye counts so much
// alone that it leaves a bright block: its direction is smoothed by a kernel of that width, or kept
// in that many bins, of which fewer are dark there (README.md, bases of directions).
constexpr double kSharpLobe = 0.85;
constexpr double kSharpBandwidth = 0.2;  // [rad], epanechnikov
constexpr int kSharpRows = 4;

// Where the choice is the tool's: what a light cache holds was chosen when it was traced.
bool smoothsSharpLobes(const ParamValues& e, double sharpest) {
  return e.text("basis") == "auto" && e.text("type") == "photosphere" && e.text("cache").empty() &&
         sharpest >= kSharpLobe;
}

void heedSharpLobes(const ParamValues& e, double sharpest, FrameSetup& setup) {
  using namespace estimators;
  LightFieldLayout& l = setup.layout;
  std::string how;
  if (l.basis == Basis::view && !e.given("kernel")) {
    l.angularKernel = sphere::AngularKernel::epanechnikov;
    l.bandwidth = kSharpBandwidth;
    how = fmt::format("directions are smoothed over {} rad (estimator.kernel)", l.bandwidth);
  } else if (l.basis == Basis::histogram && !e.given("rows")) {
    how = fmt::format("light is stored in {} bins of direction (estimator.rows)", l.bins());
  }
  if (!how.empty())
    setup.notes.push_back(
        fmt::format("a phase function has a lobe of g = {:.3g}: {}", sharpest, how));
}

// Angle under which smoke sees the eye move from where it is in the middle of the shutter, up to
// which light for that one eye serves [rad].
constexpr double kSmallParallax = 0.1;

void heedParallax(const SceneFile& scene, FrameSetup& setup) {
  estimators::LightFieldLayout& l = setup.layout;
  const double parallax = setup.motion ? setup.motion->parallax(setup.worldBounds) : 0.0;
  if (scene.estimator.text("type") != "photosphere" || l.basis != estimators::Basis::view ||
      parallax <= kSmallParallax)
    return;
  const bool chosen = scene.estimator.text("basis") == "auto";
  if (chosen) l.basis = estimators::Basis::histogram;
  setup.notes.push_back(fmt::format(
      "while the shutter is open the smoke sees the camera move by {:.2g} degrees: light is {}",
      2 * parallax * 180 / kPi,
      chosen ? fmt::format("stored in {} bins of direction, which serve every eye", l.bins())
             : "stored for the eye in the middle; estimator.basis = \"histogram\" serves all"));
}

// Radius of the kernel over fluence that the work grows with the third power of [light voxels].
// Four are mush already (automaticRadius).
constexpr int kMostVoxelsWide = 8;
constexpr double kHalfDiagonal = 0.8661;  // of a cube of edge 1, and a little

// Light is kept in voxels of two density voxels unless the scene says otherwise, or the smoke is
// few of them across, several mean free paths deep in each, or in clumps of their size: what light
// does inside a voxel is lost, up to a fifth of it. Finer ones take more time and memory, so that
// there is an end to it.
constexpr double kFewVoxels = 24;  // across the smoke, in the mean of three directions
constexpr double kThickVoxel = 8, kDeepVoxel = 4;  // optical depths
constexpr double kThickShare = 0.2;                // of the smoke's cells
constexpr double kClumps = 0.4;                    // excess density
constexpr double kFinestVoxel = 0.5;               // of a density voxel
constexpr std::uint64_t kMostFineBytes = 256 << 20;

double lightVoxelEdge(const FrameSetup& setup) {
  return setup.layout.lightVoxel * setup.medium->voxelEdge();
}

// Whether much of the smoke is deeper than `depth` in each light voxel.
bool isDeep(const FrameSetup& setup, double depth) {
  const auto extinction = static_cast<float>(depth / lightVoxelEdge(setup));
  return setup.medium->majorants().shareAbove(extinction) > kThickShare;
}

// How much denser smoke is than within a light voxel around it, in the mean over the smoke: 0 where
// it is even, 0.1 in shipped simulations, 0.6 in a cloud of balls of two light voxels. Light that
// scatters in a clump is brighter there than in the gap beside it, which one voxel cannot tell
// apart.
double excessDensity(const transport::Medium& medium, double edge) {
  constexpr std::uint64_t kPlaces = 4096;
  const volume::MajorantGrid& cells = medium.majorants();
  const auto forEachFilled = [&cells](const auto& visit) {
    const Vec3i n = cells.dims();
    for (int z = 0; z < n.z; ++z)
      for (int y = 0; y < n.y; ++y)
        for (int x = 0; x < n.x; ++x)
          if (cells.majorant({x, y, z}) > 0) visit(Vec3i(x, y, z));
  };
  std::uint64_t filled = 0, cell = 0, place = 0;
  forEachFilled([&](const Vec3i&) { ++filled; });
  Rng rng(RandomKey::fromSeed(0, 0), RandomStream::visibility, 0);
  const auto apart = static_cast<float>(edge / 2);
  double excess = 0, all = 0;
  const auto look = [&](const Vec3f& p) {
    const float here = medium.extinction(p);
    if (!(here > 0)) return;
    float around = here;
    for (int corner = 0; corner < 8; ++corner)
      around += medium.extinction(
          p + apart * Vec3f(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1));
    excess += static_cast<double>(here * (here * 9 / around - 1));
    all += static_cast<double>(here);
  };
  forEachFilled([&](const Vec3i& at) {
    for (; place < kPlaces && place * filled / kPlaces == cell; ++place)
      look(Vec3f(medium.bounds().min) +
           (Vec3f(at) + Vec3f(rng.uniform(), rng.uniform(), rng.uniform())) * cells.cellSize());
    ++cell;
  });
  return all > 0 ? excess / all : 0;
}

// Weights by what is seen serve voxels of any depth.
void chooseSmoothing(const ParamValues& e, FrameSetup& setup) {
  using namespace estimators;
  LightFieldLayout& l = setup.layout;
  if (e.text("type") != "photosphere" || e.given("smoothing") || !e.text("cache").empty() ||
      l.holdsPower() || setup.medium->bounds().empty() || !isDeep(setup, kThickVoxel))
    return;
  l.smoothing = Smoothing::visible;
  setup.notes.push_back(
      fmt::format("the smoke is many mean free paths deep in each light voxel: photons count by "
                  "what {} of them (estimator.smoothing = \"visible\")",
                  l.basis == Basis::view ? "the camera sees" : "is seen from all round"));
}

void chooseLightVoxel(const ParamValues& e, FrameSetup& setup) {
  using namespace estimators;
  LightFieldLayout& l = setup.layout;
  const transport::Medium& medium = *setup.medium;
  if (e.text("type") != "photosphere" || e.given("light_voxel") || !e.text("cache").empty() ||
      l.carrier != Carrier::voxels || medium.bounds().empty())
    return;
  const Vec3d size = medium.bounds().extent();
  const double across = std::cbrt(size.x * size.y * size.z) / medium.voxelEdge();
  const double usual = l.lightVoxel;
  const double radius = e.real("radius") * setup.space.metersPerUnit;
  std::string_view why;
  while (l.lightVoxel > kFinestVoxel) {
    const bool few = across < kFewVoxels * l.lightVoxel;
    const bool deep = l.smoothing != Smoothing::visible && isDeep(setup, kDeepVoxel);
    if (!few && !deep && !(excessDensity(medium, lightVoxelEdge(setup)) > kClumps)) break;
    const double before = std::exchange(l.lightVoxel, 0.5 * l.lightVoxel);
    const double widest = kMostVoxelsWide * l.lightVoxel * medium.voxelEdge();
    if (radius > widest || predictedLightBytes(setup) > kMostFineBytes) {
      l.lightVoxel = before;
      break;
    }
    why = few    ? "few voxels across"
          : deep ? "several mean free paths deep in each voxel"
                 : "in clumps of about a light voxel";
  }
  if (l.lightVoxel < usual)
    setup.notes.push_back(
        fmt::format("the smoke is {}: light is stored in voxels of {} density voxel "
                    "(estimator.light_voxel)",
                    why, l.lightVoxel));
}

void buildLayout(const SceneFile& scene, const SetupOptions& options, FrameSetup& setup) {
  using namespace estimators;
  const ParamValues& e = scene.estimator;
  LightFieldLayout& l = setup.layout;
  const bool cached = options.forLightCache || !e.text("cache").empty();
  l = layoutOf(e, cached);
  const double sharpest = sharpestLobe(*setup.medium);
  const bool sharp = smoothsSharpLobes(e, sharpest);
  if (sharp && !e.given("rows")) l.rows = kSharpRows;  // should it come to bins
  // Light without directions serves every eye.
  const bool even = scattersEvenly(*setup.medium);
  if (!even) heedParallax(scene, setup);
  if (sharp) heedSharpLobes(e, sharpest, setup);
  // Bins would all be read alike: one coefficient holds what counts.
  const bool ofBins = l.direction != sphere::DirectionDeposit::nearest ||
                      l.representative != Representative::bin || l.merge != Merge::full ||
                      l.angularKernel != sphere::AngularKernel::none;
  if (e.text("basis") == "auto" && l.basis == Basis::histogram && !ofBins && even) {
    l.basis = Basis::sphericalHarmonics;
    l.order = 0;
  }
  l.channels = setup.effects.chromatic ? 3 : 1;
  l.phases = static_cast<int>(setup.medium->phases().size());
  for (const auto& light : setup.lights)
    l.unscattered = l.unscattered || (!light->isDelta() && setup.effects.singleScattering);
  chooseSmoothing(e, setup);
  chooseLightVoxel(e, setup);
  l.radius = e.real("radius") * setup.space.metersPerUnit;
  if (!(l.radius > 0)) {
    l.radius = automaticRadius(*setup.medium, l, static_cast<std::uint64_t>(e.integer("photons")));
    if (l.carrier == Carrier::particles) {
      // About 20 particles where they fill space evenly: a ball of 3 spacings. Power is smoothed
      // with the smoke it was left in, so it takes no more than that: what a wider radius blurs
      // over the smoke's edge soon exceeds the noise that it removes (README.md).
      const double spacings = 3.0 * carrierSpacing(setup.particles);
      l.radius = l.holdsPower() && spacings > 0 ? spacings : std::max(l.radius, spacings);
    }
  }
  // Particles are read by way of light voxels: one whose kernel meets the centre of none would lose
  // its light.
  const double narrowest = kHalfDiagonal * l.lightVoxel * setup.medium->voxelEdge();
  if (l.carrier == Carrier::particles && l.radius < narrowest) {
    if (e.real("radius") > 0)
      setup.notes.push_back(fmt::format(
          "estimator.radius = {:.4g} is less than light voxels are apart; their half diagonal, "
          "{:.4g}, is taken (lower estimator.light_voxel for less)",
          e.real("radius"), narrowest / setup.space.metersPerUnit));
    l.radius = narrowest;
  }
  const Vec3d extent = setup.medium->bounds().extent();
  const double across = std::max({extent.x, extent.y, extent.z});
  if (e.real("radius") > 0 && !setup.medium->bounds().empty() && l.radius > across &&
      (l.carrier == Carrier::particles || e.text("type") == "photon_map"))
    setup.notes.push_back(fmt::format(
        "estimator.radius = {:.4g} is wider than the smoke, {:.4g}: light scattered many times is "
        "spread far over its edge (0 chooses a radius)",
        e.real("radius"), across / setup.space.metersPerUnit));
  const double widest = kMostVoxelsWide * l.lightVoxel * setup.medium->voxelEdge();
  if (e.text("type") == "photosphere" && !l.holdsPower() && l.radius > widest) {
    setup.notes.push_back(
        fmt::format("estimator.radius = {:.4g} spans {:.3g} light voxels; {} are the most that "
                    "light is smoothed over, {:.4g} (raise estimator.light_voxel for more)",
                    e.real("radius"), l.radius / (l.lightVoxel * setup.medium->voxelEdge()),
                    kMostVoxelsWide, widest / setup.space.metersPerUnit));
    l.radius = widest;
  }
  const double deposit = e.real("deposit_radius") * setup.space.metersPerUnit;
  l.depositRadius = deposit > 0 ? deposit : l.radius;
}

// Of light that this frame stores itself; what a cache holds is known when it is read.
void noteCoarseLight(const SceneFile& scene, FrameSetup& setup) {
  if (scene.estimator.text("type") != "photosphere" || !scene.estimator.text("cache").empty() ||
      !setup.effects.multipleScattering || setup.medium->bounds().empty())
    return;
  noteCoarseDirections(setup);
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
  buildLayout(scene, options, setup);
  noteCoarseLight(scene, setup);
  const std::int64_t seed = options.seed.value_or(scene.scene.integer("seed"));
  setup.key = RandomKey::fromSeed(static_cast<std::uint64_t>(seed),
                                  scene.scene.flag("seed_per_frame") ? frame : 0);
  if (scene.render.real("target_error") > 0 || scene.render.real("time_limit") > 0)
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
  std::uint64_t bytes = 0;
  if (l.carrier == estimators::Carrier::particles)
    bytes = setup.particles.size() * values * bytesEach;
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
