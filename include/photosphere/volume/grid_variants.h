#pragma once
// The same values in other grids: what software other than ours may hand over.

#include <string_view>

#include "photosphere/core/types.h"
#include "photosphere/volume/grid.h"

namespace photosphere::volume {

/// The active values of a float grid as another type: `float`, `half` (a float grid saved as half),
/// `double`, `int32`, `int64` (rounded to the nearest) or `bool` (not 0).
/// @throws InputError for another type or another source
Grid ofType(const Grid& grid, std::string_view type);

/// One constant value over a box of voxels, inclusive, stored as tiles where they fit.
Grid constantGrid(std::string_view name, const Box3i& box, float value,
                  const Mat4d& worldFromIndex);

/// One constant vector over a box of voxels, inclusive: active ones, of length 0 too, beside a
/// background of `background`.
Grid constantVectorGrid(std::string_view name, const Box3i& box, const Vec3f& value,
                        const Vec3f& background, const Mat4d& worldFromIndex);

/// The same voxels under a frustum transform, which no matrix describes.
/// @throws InputError for a grid that is no float grid
Grid inFrustum(const Grid& grid);

/// A scalar grid that consists of tiles alone, in the largest voxels that hold the same box or
/// boxes: no larger than its smallest tile, nor than a 64th of its shortest edge, so that the ramp
/// of one voxel at its faces stays thin. Any other grid is returned as it is. What is made per
/// voxel (bricks, light, shadows) would take hours for a tile of 4096^3.
/// @param cellCentered  voxel i spans i to i + 1; else i - 1/2 to i + 1/2
Grid tilesInLargerVoxels(const Grid& grid, bool cellCentered);

}  // namespace photosphere::volume
