#pragma once
// Where caches that leave their place out belong.

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/types.h"

namespace photosphere::cli {

/// What a Blender cache leaves out: its transform lacks the domain's corner and half a voxel, its
/// velocity is in solver units.
struct Placement {
  Vec3d origin{0.0};          ///< added to transforms and positions [scene units]
  bool cellCentered = false;  ///< grid values belong to cell centres: adds half a voxel
  double velocityScale = 1;   ///< multiplies velocity grids

  bool isIdentity() const { return origin == Vec3d(0.0) && !cellCentered && velocityScale == 1; }
};

/// Places the content of one file. Particles move by `origin` only where the file's format keeps
/// them on the solver's lattice (.vdb, .uni): tables of points are in world space already.
void place(caches::CacheContent& content, const Placement& placement,
           const caches::CacheFormat& format);

}  // namespace photosphere::cli
