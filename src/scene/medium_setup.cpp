#include "medium_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "photosphere/core/error.h"
#include "photosphere/core/registry.h"
#include "photosphere/core/resources.h"
#include "photosphere/phase/phase.h"
#include "photosphere/volume/vdb_file.h"
#include "photosphere/volume/velocity.h"
#include "smoke_source.h"
#include "unseen_volumes.h"
#include "volume_emission.h"

namespace photosphere::scene {

namespace {

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

// Density scales that stay within a float's range times any density.
constexpr double kPlainScale = 1e20;

// Density with its scale where floats hold neither alone, and cut off where it is past measure.
void placeDensity(const VolumeEntry& entry, const VolumeSource& source, const Mat4d& localFromIndex,
                  std::uint64_t budget, transport::MediumVolume& placed,
                  std::vector<std::string>& notes) {
  setExtinction(entry, placed);
  volume::ValueScale values = kReadAsChecked;
  if (placed.densityScale > kPlainScale ||
      (placed.densityScale > 0 && placed.densityScale < 1 / kPlainScale))
    values.factor = std::exchange(placed.densityScale, 1.0);
  const double unit = placed.densityScale * volume::finestSpacing(localFromIndex);
  if (source.densest * values.factor * unit > kMostVoxelDepth) {
    values.most = kMostVoxelDepth / unit;
    notes.push_back(
        fmt::format("{}: grid '{}' holds densities up to {:.4g}, an optical depth of {:.3g} in one "
                    "voxel; those beyond {:.0e} are taken as that, which looks the same",
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
          volume::bricksFromGrid(source.albedo, c, source.path, false, budget, kReadAsChecked));
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

}  // namespace

void buildMedium(const SceneFile& scene, std::int64_t cacheFrame, bool wantParticles,
                 const std::optional<Vec3d>& center, FrameSetup& setup) {
  std::vector<VolumeSource> sources;
  const bool glows = scene.effects.text("emission") != "off";
  const bool moves = scene.effects.text("motion_blur") != "off";
  for (const VolumeEntry& entry : scene.volumes) {
    sources.push_back(readVolume(scene, entry, cacheFrame, {wantParticles, glows, moves}));
    setup.readSeconds += sources.back().readSeconds;
    setup.rasterizeSeconds += sources.back().rasterizeSeconds;
    setup.leftStrays = setup.leftStrays || !sources.back().kept.empty();
    setup.worldBounds.grow(sources.back().bounds());
    for (const std::string& note : sources.back().notes)
      setup.notes.push_back(note);
  }
  setup.space.metersPerUnit = scene.scene.real("meters_per_unit");
  if (!setup.worldBounds.empty()) setup.space.center = center.value_or(setup.worldBounds.center());

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
  setup.hasSmoke = !setup.worldBounds.empty();
  setup.readSeconds += watch.seconds();
}

}  // namespace photosphere::scene
