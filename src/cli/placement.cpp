#include "placement.h"

#include <glm/ext/matrix_transform.hpp>

#include "photosphere/core/log.h"
#include "photosphere/volume/vdb_file.h"

namespace photosphere::cli {

namespace {

bool isVelocity(const volume::Grid& grid) {
  return grid.kind() == volume::GridKind::vector && volume::houdiniName(grid.name()) == "v";
}

volume::Grid placed(const volume::Grid& grid, const Placement& placement) {
  Vec3d offset = placement.origin;
  if (placement.cellCentered) {
    if (grid.isAffine())
      offset += transformVector(grid.worldFromIndex(), Vec3d(0.5));
    else
      log::warning("grid '{}': has no voxel size; --cell-centered does not move it", grid.name());
  }
  volume::Grid result =
      offset == Vec3d(0.0) ? grid : volume::transformed(grid, glm::translate(Mat4d(1.0), offset));
  if (placement.velocityScale != 1 && isVelocity(grid))
    result = volume::scaled(result, placement.velocityScale);
  return result;
}

}  // namespace

void place(caches::CacheContent& content, const Placement& placement,
           const caches::CacheFormat& format) {
  if (placement.isIdentity()) return;
  for (volume::Grid& grid : content.grids)
    grid = placed(grid, placement);
  if (format.name != "vdb" && format.name != "uni") return;
  for (volume::ParticleSet& set : content.particles)
    for (Vec3d& position : set.positions)
      position += placement.origin;
}

}  // namespace photosphere::cli
