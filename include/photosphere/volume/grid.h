#pragma once
// A handle on an OpenVDB grid that keeps OpenVDB's headers out of everything but `volume`.

#include <openvdb/version.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "photosphere/core/types.h"

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {
class GridBase;
}
}  // namespace openvdb

namespace photosphere::volume {

/// What a grid's voxels hold.
enum class GridKind {
  scalar,  ///< bool, half, float, double, int32, int64
  vector,  ///< vec3s, vec3d, vec3i
  points,  ///< a point data grid
  other,   ///< read and kept, but not usable as a coefficient
};

/// Shared, immutable view of one OpenVDB grid. Copying copies a pointer.
class Grid {
 public:
  Grid() = default;
  explicit Grid(std::shared_ptr<openvdb::GridBase> grid) : m_grid(std::move(grid)) {}
  explicit operator bool() const { return m_grid != nullptr; }

  std::string name() const;
  /// OpenVDB's type name, such as `float`, `vec3s` or `ptdataidx32`; ` (half)` follows where the
  /// grid is saved as half float.
  std::string valueType() const;
  GridKind kind() const;
  std::uint64_t activeVoxels() const;
  /// Active voxels, index space, inclusive; empty for a grid without active voxels.
  Box3i activeBounds() const;
  /// Active voxels as a box in world space, half a voxel beyond their centres [scene units].
  Box3d worldBounds() const;
  /// False for a frustum transform, which no matrix describes.
  bool isAffine() const;
  /// True for a signed distance, as the file says.
  bool isLevelSet() const;
  /// Column-major GLM matrix. @throws InputError when not affine
  Mat4d worldFromIndex() const;
  /// Edge lengths of one voxel [scene units].
  Vec3d voxelSize() const;
  /// Grid metadata as text.
  std::map<std::string, std::string> metadata() const;
  std::uint64_t memoryBytes() const;

  const std::shared_ptr<openvdb::GridBase>& base() const { return m_grid; }

 private:
  std::shared_ptr<openvdb::GridBase> m_grid;
};

}  // namespace photosphere::volume
