#pragma once
// All reading and writing of .vdb files.

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "photosphere/volume/grid.h"
#include "photosphere/volume/particle_set.h"

namespace photosphere::volume {

/// The grids and file metadata of one .vdb file.
struct VdbFile {
  std::string path;
  std::vector<Grid> grids;
  std::map<std::string, std::string> metadata;

  /// The grid of that name.
  /// @throws InputError (exit 4) listing the grids when it is missing, or when several share the
  /// name
  const Grid& find(std::string_view name) const;
  /// First grid of that name, or nullptr.
  const Grid* tryFind(std::string_view name) const;
  /// First point grid, or nullptr.
  const Grid* points() const;
};

/// Reads a whole .vdb file. The file is checked first (descriptor walk: magic, version, grid count,
/// offsets inside the file), then read without delayed loading, with a guard that turns an abort or
/// a crash of the library into a message and exit 4 (ARCHITECTURE.md, Errors).
/// @throws InputMissingError, InputError; MemoryError where the process's own limit is used up
VdbFile readVdb(const std::filesystem::path& path);

/// Whether readVdb would read the file, found out in a child process under limits of memory (4 GiB
/// and 128 times the file's size) and CPU seconds (20 and one for each 10 MB), so that a damaged
/// file can hurt nothing. Call it from a process whose other threads are idle: it forks.
/// @param reason  why not, with the file's name; empty when true
/// @throws MemoryError where the process's own limit of memory is tighter, and used up
bool probeVdb(const std::filesystem::path& path, std::string& reason);

/// Writes grids as one .vdb, whole or not at all: by OpenVDB's archive on a stream that throws on a
/// write error (io::File::write hides them), its descriptors walked again, flushed, renamed. The
/// file has grid offsets, so that other software can load single grids of it; grids marked half
/// float stay so; blosc where the library has it.
/// @throws OutputError
void writeVdb(const std::filesystem::path& path, const std::vector<Grid>& grids,
              const std::map<std::string, std::string>& metadata = {});

/// A point data grid of all attributes. `v` etc. keep their names; vec3 float attributes are stored
/// as vec3s, arity 2, 4 and above as strided float, text as string attributes.
/// @param voxelSize  edge of a point voxel [scene units]; 0 = chosen for about 8 points a voxel
Grid pointsToGrid(const ParticleSet& particles, std::string_view name, double voxelSize);

/// All points of a point data grid, in the grid's own order (leaf by leaf), positions in world
/// space. Any position codec (float, half, fixed point 8 and 16) and attribute type.
ParticleSet gridToPoints(const Grid& grid);

/// Creates a float grid from dense values: x fastest, `values.size() == dim.x * dim.y * dim.z`.
/// Values equal to `background` stay inactive.
/// @param origin  index of the first voxel
Grid denseToGrid(std::string_view name, const Vec3i& dim, const std::vector<float>& values,
                 const Mat4d& worldFromIndex, const Vec3i& origin = Vec3i(0), float background = 0);
/// The same for vectors (three floats a voxel).
Grid denseVectorToGrid(std::string_view name, const Vec3i& dim, const std::vector<float>& values,
                       const Mat4d& worldFromIndex, const Vec3i& origin = Vec3i(0));

/// The same grid with its transform preceded in world space by `worldFromOldWorld`.
Grid transformed(const Grid& grid, const Mat4d& worldFromOldWorld);
/// The same grid under another name.
Grid renamed(const Grid& grid, std::string_view name);
/// The same vector grid with every value multiplied.
Grid scaled(const Grid& grid, double factor);

/// Visits every active value of a scalar grid that is not a point grid (tiles are visited voxel by
/// voxel only up to `maxVoxels`, then the call throws MemoryError), as float.
struct GridStatistics {
  double min = 0, max = 0, mean = 0;
  std::uint64_t nans = 0, infinities = 0, negatives = 0;
  Vec3i firstInvalid{0};  ///< index of the first NaN or infinite voxel met
};
/// Statistics of a scalar grid's active voxels, or of the lengths of a vector grid's.
GridStatistics statistics(const Grid& grid);

}  // namespace photosphere::volume
