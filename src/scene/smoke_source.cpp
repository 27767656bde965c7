#include "smoke_source.h"

#include <fmt/format.h>

#include <cmath>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"
#include "photosphere/volume/grid_variants.h"
#include "photosphere/volume/invalid_values.h"
#include "photosphere/volume/rasterize.h"
#include "photosphere/volume/strays.h"
#include "photosphere/volume/vdb_file.h"
#include "photosphere/volume/velocity.h"

namespace photosphere::scene {

using volume::Grid;
using volume::GridKind;

namespace {

Mat4d translation(const Vec3d& offset) {
  Mat4d m(1.0);
  m[3] = glm::dvec4(offset, 1.0);
  return m;
}

const Grid& findGrid(const CacheGrids& cache, std::string_view key, const std::string& name) {
  const Grid* found = nullptr;
  for (const Grid& grid : cache.grids) {
    if (grid.name() != name) continue;
    if (found)
      throw InputError(cache.path,
                       fmt::format("several grids are named '{}'; rename all but one", name));
    found = &grid;
  }
  if (found) return *found;
  const std::string points =
      cache.pointGrids.empty()
          ? ""
          : " and points, which only carry light where a file has grids (remove the grids to "
            "rasterize the points)";
  throw InputError(cache.path,
                   fmt::format("no grid is named '{}' (the file has {}{}); set volume.{} to one of "
                               "them",
                               name, cache.listing(), points, key));
}

void checkAffine(const std::string& path, const Grid& grid) {
  if (grid.isAffine()) return;
  throw InputError(path, fmt::format("grid '{}' has a frustum transform, which no renderer of "
                                     "straight voxels can place; resample it to a linear transform "
                                     "(Houdini: VDB Resample) first",
                                     grid.name()));
}

// Invalid values end the frame, or become zero where the user allows that.
// @param key  what the grid is used as
// @return the largest value that stays
double heedInvalid(const SceneFile& scene, std::string_view key, bool negatives, Grid& grid,
                   VolumeSource& source) {
  const volume::InvalidValues found = volume::findInvalid(grid, negatives);
  if (found.total() == 0) return found.largest;
  if (found.negatives > 0 && grid.isLevelSet())
    throw InputError(source.path, fmt::format("grid '{}', used as {}, is a level set: distances "
                                              "from a surface, below zero within; export a fog "
                                              "volume (Houdini: Convert VDB)",
                                              grid.name(), key));
  if (!scene.allowInvalid)
    throw InputError(source.path,
                     fmt::format("grid '{}', used as {}, holds {}; clean the cache, or give "
                                 "--allow-invalid to treat them as zero",
                                 grid.name(), key, found.text()));
  source.notes.push_back(fmt::format("{}: grid '{}', used as {}: {}; all are treated as zero",
                                     source.path, grid.name(), key, found.text()));
  grid = volume::withInvalidAsZero(grid, negatives);
  return found.largest;
}

// One set of all particles of a file; the attributes of the first system decide when there are
// several.
volume::ParticleSet pointsOf(const CacheGrids& cache) {
  if (cache.pointGrids.size() > 1)
    throw InputError(
        cache.path, fmt::format("holds {} point grids and no density; `photosphere convert` merges "
                                "them into one",
                                cache.pointGrids.size()));
  return volume::gridToPoints(cache.pointGrids.front());
}

// Particles that cannot be what they should end the frame, or do without where the user allows it.
// @param fault  what they have
// @param then   what becomes of them
void heedParticles(const SceneFile& scene, std::uint64_t count, std::size_t all,
                   std::uint64_t first, std::string_view fault, std::string_view then,
                   VolumeSource& source) {
  if (count == 0) return;
  const std::string what =
      fmt::format("{} of {} particles have a {}, the first is number {}", count, all, fault, first);
  if (!scene.allowInvalid)
    throw InputError(
        source.path,
        fmt::format("{}; clean the cache, or give --allow-invalid to leave them out", what));
  source.notes.push_back(fmt::format("{}: {}; {}", source.path, what, then));
}

bool leavesOutStrays(const VolumeEntry& entry) {
  return entry.values.text("strays") == "leave_out";
}

// From here on nothing of the volume lies outside of what is kept.
void noteStrays(const volume::Strays& strays, std::string_view kind, VolumeSource& source) {
  source.kept = strays.kept;
  source.notes.push_back(fmt::format("{}: {}; left out (volume.strays = \"keep\" keeps them)",
                                     source.path, strays.text(kind)));
}

void leaveOutStrays(VolumeSource& source) {
  const Grid grids[] = {source.density, source.emission};
  if (const auto strays = volume::findStrays(grids)) noteStrays(*strays, "voxels", source);
  if (source.kept.empty()) return;
  for (Grid* grid : {&source.density, &source.emission, &source.velocity, &source.albedo})
    if (*grid) *grid = volume::clipped(*grid, source.kept);
}

Grid rasterized(const SceneFile& scene, const CacheGrids& cache, const VolumeEntry& entry,
                bool wantVelocity, VolumeSource& source) {
  const Stopwatch watch;
  volume::RasterizeOptions options;
  options.radius = entry.values.real("particle_radius");
  options.leaveOutStrays = leavesOutStrays(entry);
  const volume::ParticleSet points = pointsOf(cache);
  if (!cache.unplaced.empty())
    heedParticles(scene, cache.unplaced.size(), points.size() + cache.unplaced.size(),
                  cache.unplaced.front(), "position that is not finite", "they are left out",
                  source);
  if (points.size() == 0) return {};
  const volume::RasterizeResult result = [&] {
    try {
      return volume::rasterize(points, options);
    } catch (const ConfigError& error) {
      throw InputError(cache.path, error.what());
    } catch (const MemoryError& error) {
      throw MemoryError(fmt::format("{}: {}", cache.path, error.what()));
    }
  }();
  heedParticles(scene, result.skipped, points.size(), result.firstSkipped,
                "position, radius or mass that is negative or not finite", "they are left out",
                source);
  source.notes.push_back(
      fmt::format("{}: {} points rasterized at voxel edge {:.4g}, radius {:.4g} to {:.4g}{}",
                  cache.path, points.size(), result.voxelSize, result.radiusMin, result.radiusMax,
                  result.radiusFromSpacing ? " (from their spacing; they have no pscale)" : ""));
  options.leaveOutStrays = false;
  if (result.strays) {
    noteStrays(*result.strays, "particles", source);
    options.within = result.strays->kept;
  }
  if (const std::string& name = entry.values.text("velocity"); wantVelocity && !name.empty()) {
    const volume::InvalidVelocities invalid = volume::findInvalidVelocities(points, name);
    heedParticles(scene, invalid.count, points.size(), invalid.first,
                  fmt::format("velocity '{}' that is not finite", name),
                  "the others move the smoke", source);
    source.velocity = volume::velocityOfParticles(points, name, options, cache.path);
  }
  source.rasterizeSeconds = watch.seconds();
  return result.density;
}

void checkAlbedo(const std::string& path, const Grid& grid) {
  const double most = grid.kind() == GridKind::vector ? std::sqrt(3.0) : 1.0;
  const volume::GridStatistics found = volume::statistics(grid);
  if (grid.activeVoxels() > 0 && (found.max > most * 1.0001 || found.min < 0))
    throw InputError(path, fmt::format("grid '{}' is used as albedo but holds {:.4g} to {:.4g}; an "
                                       "albedo lies in [0, 1]",
                                       grid.name(), found.min, found.max));
}

// Beyond this floats do not hold the square of a distance.
constexpr double kFarthest = 1e18;

void checkReach(const VolumeEntry& entry, const VolumeSource& source) {
  const Box3d box = source.bounds();
  if (box.empty()) return;
  const Vec3d far = glm::max(glm::abs(box.min), glm::abs(box.max));
  if (maxComponent(far) <= kFarthest) return;
  throw InputError(
      source.path,
      fmt::format("reaches {:.4g} scene units from the origin, and no more than {:g} can be "
                  "rendered; mend the file's transform, or 'transform' and 'origin' of {}",
                  maxComponent(far), kFarthest, entry.where));
}

}  // namespace

std::string CacheGrids::listing() const {
  std::vector<std::string> names;
  for (const Grid& grid : grids)
    names.push_back(fmt::format("'{}' ({})", grid.name(), grid.valueType()));
  return names.empty() ? "no grids" : fmt::format("{}", fmt::join(names, ", "));
}

CacheGrids readCacheGrids(const std::string& path) {
  CacheGrids out;
  out.path = path;
  if (caches::detectFormat(path).name == "vdb") {
    volume::VdbFile file = volume::readVdb(path);
    for (Grid& grid : file.grids)
      (grid.kind() == GridKind::points ? out.pointGrids : out.grids).push_back(std::move(grid));
    return out;
  }
  caches::CacheContent content = caches::readCache(path);
  out.grids = std::move(content.grids);
  out.notes = std::move(content.notes);
  // A frame of no particles is a frame as well: of nothing.
  for (volume::ParticleSet& set : content.particles) {
    const std::vector<std::size_t> unplaced = set.removeUnplaced();
    out.unplaced.insert(out.unplaced.end(), unplaced.begin(), unplaced.end());
    try {
      out.pointGrids.push_back(volume::pointsToGrid(set, "points", 0));
    } catch (const ConfigError& error) {
      throw InputError(path, error.what());
    }
  }
  return out;
}

Mat4d VolumeSource::worldFromIndex(const Grid& grid) const {
  return worldFromFile * grid.worldFromIndex() * translation(indexShift);
}

Box3d VolumeSource::bounds() const {
  Box3d box;
  for (const Grid* grid : {&density, &emission}) {
    const Box3i active = *grid ? grid->activeBounds() : Box3i();
    if (active.empty()) continue;
    // Interpolation reaches one voxel beyond the active ones.
    box.grow(
        transformBox(worldFromIndex(*grid), {Vec3d(active.min) - 1.0, Vec3d(active.max) + 1.0}));
  }
  return box;
}

VolumeSource readVolume(const SceneFile& scene, const VolumeEntry& entry, std::int64_t frame,
                        const SourceWishes& wishes) {
  VolumeSource source;
  source.path = framePath(scene.resolvePath(entry.values.text("file")), frame);
  source.worldFromFile =
      entry.values.matrix("transform") * translation(entry.values.vec3("origin"));
  const Mat4d& m = source.worldFromFile;
  if (m[0][3] != 0 || m[1][3] != 0 || m[2][3] != 0 || m[3][3] != 1 ||
      !(std::abs(glm::determinant(Mat3d(m))) > 1e-30))
    throw ConfigError(
        fmt::format("{}: 'transform' must be affine and invertible: row-major, its "
                    "last row 0, 0, 0, 1",
                    entry.where));

  const Stopwatch watch;
  const CacheGrids cache = readCacheGrids(source.path);
  source.notes = cache.notes;
  source.readSeconds = watch.seconds();
  if (cache.grids.empty() && cache.pointGrids.empty())
    throw InputError(source.path, "holds neither grids nor points");
  if (cache.grids.empty()) {
    source.density = rasterized(scene, cache, entry, wishes.velocity, source);
  } else {
    source.density = findGrid(cache, "density", entry.values.text("density"));
    if (source.density.kind() != GridKind::scalar)
      throw InputError(source.path,
                       fmt::format("grid '{}' is of type {}; a density is one number a voxel",
                                   source.density.name(), source.density.valueType()));
    // A rasterized grid has its values at its nodes already.
    if (entry.values.flag("cell_centered")) source.indexShift = Vec3d(0.5);
  }
  if (source.density) {
    checkAffine(source.path, source.density);
    source.densest = heedInvalid(scene, "density", true, source.density, source);
    source.density =
        volume::tilesInLargerVoxels(source.density, entry.values.flag("cell_centered"));
  }
  if (const std::string& name = entry.values.text("velocity");
      wishes.velocity && !name.empty() && !cache.grids.empty()) {
    source.velocity = findGrid(cache, "velocity", name);
    if (source.velocity.kind() != GridKind::vector)
      throw InputError(source.path,
                       fmt::format("grid '{}' is of type {}; a velocity is a vector a voxel", name,
                                   source.velocity.valueType()));
    checkAffine(source.path, source.velocity);
    heedInvalid(scene, "velocity", false, source.velocity, source);
  }
  if (!entry.albedoGrid.empty()) {
    source.albedo = findGrid(cache, "albedo", entry.albedoGrid);
    checkAffine(source.path, source.albedo);
    heedInvalid(scene, "albedo", true, source.albedo, source);
    checkAlbedo(source.path, source.albedo);
  }
  if (wishes.emission && entry.emits) {
    const std::string& temperature = entry.emission.text("temperature");
    source.emission = temperature.empty()
                          ? findGrid(cache, "emission.grid", entry.emission.text("grid"))
                          : findGrid(cache, "emission.temperature", temperature);
    if (source.emission.kind() != GridKind::scalar)
      throw InputError(source.path,
                       fmt::format("grid '{}' is of type {}; an emission is one number a voxel",
                                   source.emission.name(), source.emission.valueType()));
    checkAffine(source.path, source.emission);
    heedInvalid(scene, "emission", temperature.empty(), source.emission, source);
  }
  if (!cache.grids.empty() && leavesOutStrays(entry)) leaveOutStrays(source);
  checkReach(entry, source);
  if (wishes.particles)
    for (const Grid& grid : cache.pointGrids)
      for (const Vec3d& p : volume::gridToPoints(grid).positions)
        if (source.kept.empty() || source.kept.contains(p))
          source.particles.push_back(transformPoint(source.worldFromFile, p));
  return source;
}

}  // namespace photosphere::scene
