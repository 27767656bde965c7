#pragma once
// What a simulation lost: a few particles or voxels so far from all else that the box around
// everything says nothing of the smoke. A frame is laid out by that box: its positions are floats
// about its middle, lamps shine on all of it, shadows and light lie in tables over it.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "photosphere/core/types.h"
#include "photosphere/volume/grid.h"

namespace photosphere::volume {

/// Particles (by their mass: RasterizeOptions::leaveOutStrays) or voxels (by their value) that hold
/// at most 0.5 % of the smoke, are at most 1 % of their kind, and lie farther than 64 times the
/// longest edge of the box around the rest from that box.
struct Strays {
  Box3d kept;               ///< holds all but them [scene units of the file]
  std::uint64_t count = 0;  ///< how many they are
  std::uint64_t all = 0;    ///< of how many
  double share = 0;         ///< of the smoke: mass, or sum of values
  double farthest = 0;      ///< from the box of the rest [scene units]
  double size = 0;          ///< longest edge of that box [scene units]

  /// "1 of 3001 particles (0.033 % of the smoke) lies up to 1e+06 units away from the rest, which
  /// is 0.9 across".
  std::string text(std::string_view kind) const;
};

/// Strays of the active voxels of scalar grids of one file, each of which counts as much as the
/// others; empty handles are passed over, and values that are not above 0 or not finite.
/// @throws InputError for a grid that is not scalar, or not affine
std::optional<Strays> findStrays(std::span<const Grid> grids);

/// A scalar or vector grid without the leaves and tiles whose middle lies outside a box of its own
/// world space. @throws InputError for a grid of another kind, or not affine
Grid clipped(const Grid& grid, const Box3d& box);

}  // namespace photosphere::volume
