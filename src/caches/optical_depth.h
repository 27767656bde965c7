#pragma once
// How thick a density grid is to light.

#include <optional>

#include "photosphere/caches/inspect.h"

namespace photosphere::caches {

/// Optical depths of a float or double grid along all axis-aligned voxel columns that meet smoke:
/// at least a thousandth of the depth of the thickest. Negative and non-finite densities count as
/// none. Columns are averaged over squares of columns where a side of the box holds more than a
/// million of them.
/// @return nothing for other grids, a frustum transform or no positive density
std::optional<OpticalDepth> measureOpticalDepth(const volume::Grid& grid);

}  // namespace photosphere::caches
