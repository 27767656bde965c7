#include "photosphere/scene/frame_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "camera_setup.h"
#include "effect_plan.h"
#include "estimator_options.h"
#include "photon_map_stage.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/registry.h"
#include "photosphere/core/resources.h"
#include "photosphere/phase/phase.h"
#include "photosphere/scene/plan.h"
#include "photosphere/volume/rasterize.h"
#include "photosphere/volume/vdb_file.h"
#include "photosphere/volume/velocity.h"
#include "smoke_source.h"
#include "unseen_volumes.h"
#include "volume_emission.h"

namespace photosphere::scene {

namespace {

// Independent parts of a frame whose error is estimated: the relative standard error of a variance
// from eight is about a half, but the mean of it over pixels is far better.
constexpr int kErrorBatches = 8;
// Voxels that a velocity is carried on beyond those that the cache has.
constexpr double kMostMargin = 24;

Mat4d localFromWorld(const lights::LocalSpace& space) {
  Mat4d m(space.metersPerUnit);
  m[3] = glm::dvec4(-space.center * space.metersPerUnit, 1.0);
  return m;
}

Mat4d nodeShift(const Vec3i& origin) {
  Mat4d m(1.0);
  m[3] = glm::dvec4(Vec3d(origin), 1.0);
  return m;
}

std::uint64_t memoryBudget(const SceneFile& scene) {
  const double limit = scene.render.real("memory_limit");
  if (limit < 0) return 0;
  const double bytes = limit > 0 ? limit * 1024.0 * 1024.0 * 1024.0
                                 : 0.85 * static_cast<double>(availableMemoryBytes());
  return static_cast<std::uint64_t>(std::max(1.0, std::min(bytes, 9e18)));
}

bool sameNodes(const volume::BrickField<float>& a, const volume::BrickField<float>& b) {
  if (a.origin() != b.origin() || a.bricks() != b.bricks() || a.empty() != b.empty()) return false;
  const Vec3i& bricks = a.bricks();
  for (int z = 0; z < bricks.z && !a.empty(); ++z)
    for (int y = 0; y < bricks.y; ++y)
      for (int x = 0; x < bricks.x; ++x) {
        const std::int32_t i = a.brickAt({x, y, z}), j = b.brickAt({x, y, z});
        if ((i < 0) != (j < 0)) return false;
        if (i >= 0 && !std::equal(a.nodes(i), a.nodes(i) + a.kBrickSize, b.nodes(j))) return false;
      }
  return true;
}

// One field says what three equal ones do: the albedo is grey.
void dropEqualChannels(std::vector<volume::BrickField<float>>& fields) {
  if (fields.size() == 3 && sameNodes(fields[0], fields[1]) && sameNodes(fields[0], fields[2]))
    fields.resize(1);
}

// Largest of [r, g, b].
double largestScale(const VolumeEntry& entry) {
  return maxComponent(entry.values.vec3("density_scale"));
}

// The densest channel's, and what the others have of it.
void setExtinction(const VolumeEntry& entry, transport::MediumVolume& placed) {
  placed.densityScale = largestScale(entry);
  if (placed.densityScale > 0)
    placed.tint = Rgb(entry.values.vec3("density_scale") / placed.densityScale);
}

// Velocity in local space, wide enough for all that moves while the shutter is open.
transport::VolumeMotion placeMotion(const VolumeSource& source, const lights::LocalSpace& space,
                                    const transport::Shutter& shutter, std::uint64_t budget,
                                    std::vector<std::string>& notes) {
  transport::VolumeMotion motion;
  if (!source.velocity || !(shutter.longest() > 0)) return motion;
  const Mat3d linear(localFromWorld(space) * source.worldFromFile);
  const Mat4d localFromIndex = localFromWorld(space) * source.worldFromIndex(source.velocity);
  const double raw = volume::statistics(source.velocity).max;
  const double longest =
      std::max({glm::length(linear[0]), glm::length(linear[1]), glm::length(linear[2])});
  const double voxels = raw * longest * shutter.longest() / volume::finestSpacing(localFromIndex);
  const int margin = static_cast<int>(std::min(std::ceil(voxels) + 1, kMostMargin));
  if (voxels > kMostMargin)
    notes.push_back(fmt::format(
        "{}: the fastest of '{}' moves {:.3g} voxels while the shutter is open on one side of the "
        "frame; smoke that goes farther than {} voxels beyond the cache's is lost. Velocities are "
        "scene units a second: convert --velocity-scale brings those of a solver there",
        source.path, source.velocity.name(), voxels, kMostMargin));
  const volume::Grid grid =
      volume::velocityForLookups(source.velocity, linear, margin, source.path);
  motion.velocity = volume::vectorBricksFromGrid(grid, source.path, budget);
  motion.localFromNode = localFromIndex * nodeShift(motion.velocity.origin());
  volume::forEachNode(motion.velocity, [&](const Vec4f& v) {
    motion.fastest = std::max(motion.fastest, glm::length(Vec3d(v)));
  });
  return motion;
}

// Optical depth of one voxel from where on more of it shows nowhere: the eye sees 1 % of such a
// voxel's edge deep, and of light that scatters without loss 1 / 10,000 passes. Beyond, distances
// between collisions would be lost in the rounding of positions, and extinction in the range of a
// float.
constexpr double kMostVoxelDepth = 1e4;
// Density scales that stay within a float's range times any density.
constexpr double kPlainScale = 1e20;

// Density with its scale where floats hold neither alone, and cut off where it is past measure.
void placeDensity(const VolumeEntry& entry, const VolumeSource& source, const Mat4d& localFromIndex,
                  std::uint64_t budget, transport::MediumVolume& placed,
                  std::vector<std::string>& notes) {
  setExtinction(entry, placed);
  volume::ValueScale values;
  if (placed.densityScale > kPlainScale ||
      (placed.densityScale > 0 && placed.densityScale < 1 / kPlainScale))
    values.factor = std::exchange(placed.densityScale, 1.0);
  const double unit = placed.densityScale * volume::finestSpacing(localFromIndex);
  if (source.densest * values.factor * unit > kMostVoxelDepth) {
    values.most = kMostVoxelDepth / unit;
    notes.push_back(
        fmt::format("{}: grid '{}' holds densities up to {:.4g}, an optical depth of {:.3g} in one "
                    "voxel; those "
                    "beyond {:.0e} are taken as that, which looks the same",
                    source.path, source.density.name(), source.densest,
                    source.densest * values.factor * unit, kMostVoxelDepth));
  }
  placed.density = volume::bricksFromGrid(source.density, 0, source.path, false, budget, values);
}

transport::MediumVolume placeVolume(const VolumeEntry& entry, const VolumeSource& source,
                                    const lights::LocalSpace& space, std::uint64_t budget,
                                    std::vector<std::string>& notes) {
  transport::MediumVolume placed;
  if (!source.density) return placed;
  placed.name = source.density.name();
  const Mat4d localFromIndex = localFromWorld(space) * source.worldFromIndex(source.density);
  placeDensity(entry, source, localFromIndex, budget, placed, notes);
  placed.localFromNode = localFromIndex * nodeShift(placed.density.origin());
  placed.albedo = entry.values.rgb("albedo");
  if (source.albedo) {
    const int components = source.albedo.kind() == volume::GridKind::vector ? 3 : 1;
    for (int c = 0; c < components; ++c)
      placed.albedoFields.push_back(
          volume::bricksFromGrid(source.albedo, c, source.path, false, budget));
    dropEqualChannels(placed.albedoFields);
    placed.localFromAlbedoNode = localFromWorld(space) * source.worldFromIndex(source.albedo) *
                                 nodeShift(placed.albedoFields.front().origin());
  }
  placed.phase = findPlugin(phase::phaseFunctions(), entry.phase, "phase", entry.where)
                     .create(entry.phaseValues);
  return placed;
}

// True when something in the source can be seen at this density scale.
bool visible(const VolumeSource& source, double densityScale) {
  const bool smoke = source.density && !source.density.activeBounds().empty() && densityScale > 0;
  return smoke || (source.emission && !source.emission.activeBounds().empty());
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

// Particles that lie exactly where others do carry no light of their own: every photon in range of
// one would be shared out to all of them, which takes as long as there are many. The first stays.
void dropCoincident(FrameSetup& setup) {
  std::vector<Vec3f>& particles = setup.particles;
  std::vector<std::uint32_t> order(particles.size());
  std::iota(order.begin(), order.end(), 0u);
  // By bits, which have an order whatever they stand for.
  const auto keyOf = [&](std::uint32_t i) {
    const Vec3f& p = particles[i];
    return std::tuple(std::bit_cast<std::uint32_t>(p.x), std::bit_cast<std::uint32_t>(p.y),
                      std::bit_cast<std::uint32_t>(p.z), i);
  };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return keyOf(a) < keyOf(b); });
  std::vector<bool> dropped(particles.size());
  std::size_t count = 0;
  for (std::size_t i = 1; i < order.size(); ++i)
    if (particles[order[i]] == particles[order[i - 1]]) {
      dropped[order[i]] = true;
      ++count;
    }
  if (count == 0) return;
  std::vector<Vec3f> kept;
  kept.reserve(particles.size() - count);
  for (std::size_t i = 0; i < particles.size(); ++i)
    if (!dropped[i]) kept.push_back(particles[i]);
  setup.notes.push_back(fmt::format(
      "{} of {} particles lie exactly where others do; one of each place carries the light", count,
      particles.size()));
  particles = std::move(kept);
}

// Two passes: where the smoke is, then the smoke about its own centre.
void buildMedium(const SceneFile& scene, std::int64_t cacheFrame, bool wantParticles,
                 FrameSetup& setup) {
  std::vector<VolumeSource> sources;
  const bool glows = scene.effects.text("emission") != "off";
  const bool moves = scene.effects.text("motion_blur") != "off";
  for (const VolumeEntry& entry : scene.volumes) {
    sources.push_back(readVolume(scene, entry, cacheFrame, {wantParticles, glows, moves}));
    setup.readSeconds += sources.back().readSeconds;
    setup.rasterizeSeconds += sources.back().rasterizeSeconds;
    setup.worldBounds.grow(sources.back().bounds());
    for (const std::string& note : sources.back().notes)
      setup.notes.push_back(note);
  }
  setup.space.metersPerUnit = scene.scene.real("meters_per_unit");
  if (!setup.worldBounds.empty()) setup.space.center = setup.worldBounds.center();

  const Stopwatch watch;
  const Vec2d frames = scene.camera.vec2("shutter") / scene.scene.real("fps");
  const transport::Shutter shutter{frames.x, frames.y};
  std::vector<transport::MediumVolume> placed;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    for (const Vec3d& p : sources[i].particles)
      setup.particles.emplace_back(setup.space.localFromWorld(p));
    if (!visible(sources[i], largestScale(scene.volumes[i]))) {
      setup.notes.push_back(fmt::format("{}: no smoke in it at this frame", sources[i].path));
      continue;
    }
    placed.push_back(
        placeVolume(scene.volumes[i], sources[i], setup.space, setup.memoryBudget, setup.notes));
    if (sources[i].emission)
      placed.back().emission =
          placeEmission(scene.volumes[i], sources[i], localFromWorld(setup.space),
                        scene.output.text("colorspace"), setup.memoryBudget, setup.notes);
    placed.back().motion =
        placeMotion(sources[i], setup.space, shutter, setup.memoryBudget, setup.notes);
    if (placed.back().density.empty() && placed.back().emission.field.empty()) placed.pop_back();
  }
  dropCoincident(setup);
  setup.medium = std::make_unique<transport::Medium>(std::move(placed), shutter);
  // Active voxels may hold zeros: what frames the smoke is the box of what scatters or emits.
  setup.worldBounds = worldBoundsOf(*setup.medium, setup.space);
  setup.readSeconds += watch.seconds();
}

void buildLights(const SceneFile& scene, FrameSetup& setup) {
  for (const LightEntry& entry : scene.lights) {
    if (entry.type == "environment" && scene.effects.text("environment") == "off") continue;
    const lights::LightPlugin& plugin =
        findPlugin(lights::lightModels(), entry.type, "light type", entry.where);
    try {
      ParamValues values = entry.values;
      if (values.given("file"))
        values.set("file", scene.resolvePath(values.text("file")), entry.where);
      setup.lights.push_back(plugin.create(values, setup.space));
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("{}: {}", entry.where, error.what()));
    }
    setup.lights.back()->setName(entry.values.text("name"));
  }
}

// Nearest-neighbour spacing of the carriers [m].
double carrierSpacing(const std::vector<Vec3f>& particles) {
  volume::ParticleSet set;
  set.positions.assign(particles.begin(), particles.end());
  return set.size() > 1 ? volume::medianSpacing(set) : 0.0;
}

// Mean cosine of the sharpest lobe, and from where on bins have less error than the view basis
// (README.md, bases of directions): a photon that happens to fly toward the eye counts alone there,
// and leaves a bright block.
constexpr double kSharpLobe = 0.85;
constexpr int kSharpRows = 4;  // fewer bins than 128 are dark there

// Smoke that has no wider lobes than these has nothing that bins could hold: each is lost in one,
// whose light is then seen from where none goes.
constexpr double kNeedle = 0.99;

struct LobeRange {
  double sharpest = 0, widest = 1;  // |g|
};

LobeRange lobesOf(const transport::Medium& medium) {
  LobeRange range;
  for (const phase::PhaseFunction& phase : medium.phases())
    for (int i = 0; i < phase.lobes(); ++i) {
      const double g = std::abs(phase.lobe(i).g());
      range.sharpest = std::max(range.sharpest, g);
      range.widest = std::min(range.widest, g);
    }
  return range;
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

void buildLayout(const SceneFile& scene, const SetupOptions& options, FrameSetup& setup) {
  using namespace estimators;
  const ParamValues& e = scene.estimator;
  LightFieldLayout& l = setup.layout;
  const bool cached = options.forLightCache || !e.text("cache").empty();
  l = layoutOf(e, cached);
  const LobeRange lobes = lobesOf(*setup.medium);
  if (const double g = lobes.sharpest; e.text("basis") == "auto" && l.basis == Basis::view &&
                                       g >= kSharpLobe && lobes.widest < kNeedle) {
    l.basis = Basis::histogram;
    if (!e.given("rows")) l.rows = kSharpRows;
    if (e.text("type") == "photosphere")
      setup.notes.push_back(
          fmt::format("a phase function has a lobe of g = {:.3g}: light is stored in {} bins of "
                      "direction, as estimator.basis = \"view\" would be noisier",
                      g, l.bins()));
  }
  // Light without directions serves every eye.
  const bool even = scattersEvenly(*setup.medium);
  if (!even) heedParallax(scene, setup);
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
  const double widest = kMostVoxelsWide * l.lightVoxel * setup.medium->voxelEdge();
  if (e.text("type") == "photosphere" && !l.holdsPower() && l.radius > widest) {
    setup.notes.push_back(
        fmt::format("estimator.radius = {:.4g} spans {:.3g} light voxels; {} are the most that "
                    "light is smoothed "
                    "over, {:.4g} (raise estimator.light_voxel for more)",
                    e.real("radius"), l.radius / (l.lightVoxel * setup.medium->voxelEdge()),
                    kMostVoxelsWide, widest / setup.space.metersPerUnit));
    l.radius = widest;
  }
  const double deposit = e.real("deposit_radius") * setup.space.metersPerUnit;
  l.depositRadius = deposit > 0 ? deposit : l.radius;
}

}  // namespace

FrameSetup setUpFrame(const SceneFile& written, std::int64_t frame, const SetupOptions& options) {
  const SceneFile scene = sceneOfFrame(written, frame, options);
  FrameSetup setup;
  setup.frame = frame;
  setup.memoryBudget = memoryBudget(scene);
  const bool particles = scene.estimator.text("type") == "photosphere" &&
                         scene.estimator.text("carrier") == "particles";
  buildMedium(scene, options.cacheFrame.value_or(frame), particles, setup);
  buildLights(scene, setup);
  buildCamera(scene, setup);
  planEffects(scene, options.forLightCache || !scene.estimator.text("cache").empty(), setup);
  viewFromTheMiddle(setup);
  buildLayout(scene, options, setup);
  const std::int64_t seed = options.seed.value_or(scene.scene.integer("seed"));
  setup.key = RandomKey::fromSeed(static_cast<std::uint64_t>(seed),
                                  scene.scene.flag("seed_per_frame") ? frame : 0);
  if (scene.render.real("target_error") > 0 || scene.render.real("time_limit") > 0)
    setup.batches = kErrorBatches;
  const auto photons = static_cast<std::uint64_t>(scene.estimator.integer("photons"));
  const auto batches = static_cast<std::uint64_t>(setup.batches);
  setup.photons = (photons + batches - 1) / batches;
  planPhotonMap(scene, setup);
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
  memory.pixels = static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y) *
                  (6 * sizeof(Rgb) + 2 * sizeof(float)) *
                  (setup.batches > 1 || (setup.photonMap && setup.photonMap->passes > 1) ? 3 : 1);
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
      "this frame needs about {}: {} for the smoke, {} for stored light, {} for pixels; the budget "
      "is {}. {}, lower the resolution, or raise render.memory_limit (-1 = none)",
      formatBytes(memory.total()), formatBytes(memory.smoke), formatBytes(memory.light),
      formatBytes(memory.pixels), formatBytes(setup.memoryBudget), less));
}

}  // namespace photosphere::scene
