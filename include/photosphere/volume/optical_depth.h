#pragma once
// How thick a density grid is to light.

#include <optional>

#include "photosphere/volume/grid.h"

namespace photosphere::volume {

/// Optical depths of a density grid along its axes, at density_scale 1 with lengths in scene units.
struct OpticalDepth {
  double p5 = 0, median = 0, p95 = 0;  ///< percentiles over the rays of all three axes
  double meanFreePathVoxels = 0;       ///< 1 / mean density, weighted by density
  double suggestedScale = 0;           ///< density_scale that brings the median to kSmokeDepth
};

/// Median optical depth at which smoke looks like smoke: it blocks 99 % of the light and still lets
/// it scatter many times.
inline constexpr double kSmokeDepth = 5;
/// Rays thinner than this part of the thickest meet no smoke: solvers leave traces of 1e-30 all
/// over their domain, and columns of stray voxels would drag the median down.
inline constexpr double kTraceDepth = 0.01;
/// `value` to two significant digits, as suggestions are given.
double roundedToTwoDigits(double value);

/// Optical depths of a float or double grid along all axis-aligned voxel columns that meet smoke:
/// at least kTraceDepth of the depth of the thickest. Negative and non-finite densities count as
/// none. Columns are averaged over squares of columns where a side of the box holds more than a
/// million of them.
/// @return nothing for other grids, a frustum transform or no positive density
std::optional<OpticalDepth> measureOpticalDepth(const Grid& grid);

}  // namespace photosphere::volume
