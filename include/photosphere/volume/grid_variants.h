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

/// The same voxels under a frustum transform, which no matrix describes.
/// @throws InputError for a grid that is no float grid
Grid inFrustum(const Grid& grid);

}  // namespace photosphere::volume
