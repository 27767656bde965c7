#pragma once
// How thick a density grid is to light.

#include <optional>

#include "photosphere/volume/grid.h"

namespace photosphere::volume {

/// Optical depths of a density grid along its axes, at density_scale 1 with lengths in scene units.
struct OpticalDepth {
  double p5 = 0, median = 0, p95 = 0;  ///< percentiles over the rays of all three axes
  double meanFreePathVoxels = 0;       ///< 1 / mean density, weighted by density
  double suggestedScale = 0;           ///< density_scale that brings p95 to kSmokeOpticalDepth
};

/// Optical depth through its thick parts at which smoke looks like smoke: it blocks 99 % of the
/// light and still lets it scatter many times.
inline constexpr double kSmokeOpticalDepth = 5;

/// Optical depths of a float or double grid along all axis-aligned voxel columns that meet smoke:
/// at least a thousandth of the depth of the thickest. Negative and non-finite densities count as
/// none. Columns are averaged over squares of columns where a side of the box holds more than a
/// million of them.
/// @return nothing for other grids, a frustum transform or no positive density
std::optional<OpticalDepth> measureOpticalDepth(const Grid& grid);

}  // namespace photosphere::volume
