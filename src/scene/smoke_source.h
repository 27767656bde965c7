#pragma once
// The cache of one `[[volume]]` at one frame, as grids and particles in world space.

#include <cstdint>
#include <string>
#include <vector>

#include "photosphere/scene/scene_file.h"
#include "photosphere/volume/bricks.h"
#include "photosphere/volume/grid.h"
#include "photosphere/volume/particle_set.h"

namespace photosphere::scene {

/// Everything that a cache file holds; point grids stay grids until somebody wants their particles.
struct CacheGrids {
  std::string path;
  std::vector<volume::Grid> grids;       ///< without point grids
  std::vector<volume::Grid> pointGrids;  ///< of readers other than vdb: written as a grid first, so
                                         ///< that order and rounding are those of a file on disk
  std::vector<std::size_t> unplaced;     ///< numbers of particles that those readers gave no finite
                                         ///< position, and that no point grid has
  std::vector<std::string> notes;

  /// `density (float), v (vec3s)`, or "no grids".
  std::string listing() const;
};

/// @throws InputMissingError, InputError
CacheGrids readCacheGrids(const std::string& path);

/// How the grids of a VolumeSource become bricks: readVolume has looked through their values.
inline constexpr volume::ValueScale kReadAsChecked{.checked = true};

struct VolumeSource {
  std::string path;
  volume::Grid density;
  double densest = 0;            ///< largest value of `density`
  volume::Grid albedo;           ///< empty handle = the scene's constant
  volume::Grid emission;         ///< of values or temperatures; empty handle = none
  volume::Grid velocity;         ///< as the file has it; empty handle = none
  Mat4d worldFromFile{1.0};      ///< transform and origin of the scene file
  Vec3d indexShift{0.0};         ///< half a voxel where cell_centered
  Box3d kept;                    ///< of the file's space; empty = nothing was left out as strays
  std::vector<Vec3d> particles;  ///< world space, where wanted
  double readSeconds = 0, rasterizeSeconds = 0;
  std::vector<std::string> notes;

  Mat4d worldFromIndex(const volume::Grid& grid) const;
  /// Where trilinear density or emission can be anything but zero, world space; empty without
  /// active voxels.
  Box3d bounds() const;
};

/// What to hand out beside the density.
struct SourceWishes {
  bool particles = false;  ///< positions of the file's points
  bool emission = false;   ///< the grid that the entry's `emission` names
  bool velocity = false;   ///< the grid, or the points' attribute, that `velocity` names
};

/// @throws InputMissingError; InputError for a missing grid (listing what is there), a frustum
///         transform, an albedo outside [0, 1]; ConfigError for a singular transform
VolumeSource readVolume(const SceneFile& scene, const VolumeEntry& entry, std::int64_t frame,
                        const SourceWishes& wishes);

}  // namespace photosphere::scene
