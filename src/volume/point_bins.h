#pragma once
// Particles sorted into the voxels and 8^3 blocks of a point grid.

#include <cstdint>
#include <string_view>
#include <vector>

#include "openvdb_grid.h"

namespace photosphere::volume {

/// One particle's place in a point grid.
struct PointBin {
  Vec3i block;             ///< voxel coordinates over 8, rounded down
  std::uint32_t voxel;     ///< within the block, as OpenVDB counts: z fastest
  std::uint32_t particle;  ///< index in the particle set

  /// Index-space centre of the voxel.
  openvdb::Vec3d center() const {
    return {block.x * 8.0 + (voxel >> 6), block.y * 8.0 + ((voxel >> 3) & 7),
            block.z * 8.0 + (voxel & 7)};
  }
};

/// All particles with a finite position, sorted by block, voxel and index.
/// @throws ConfigError when voxels are so small that indices leave 31 bits
std::vector<PointBin> binPoints(const std::vector<Vec3d>& positions,
                                const openvdb::math::Transform& transform);

/// Voxel size at which an occupied voxel holds about 8 particles [scene units].
double pointVoxelSize(const std::vector<Vec3d>& positions);

/// Uniform scale. Moves the origin only where indices would leave 30 bits otherwise: shared origins
/// let tools combine grids.
Mat4d worldFromPointIndex(const std::vector<Vec3d>& positions, double voxelSize);

/// Metadata that OpenVDB itself keeps on a grid (name, class, file statistics).
bool isGridBookkeeping(std::string_view key);

}  // namespace photosphere::volume
