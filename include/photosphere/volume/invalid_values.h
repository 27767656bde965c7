#pragma once
// Values that no coefficient can have: found, counted, and replaced where the user allows it.

#include <cstdint>
#include <string>

#include "photosphere/core/types.h"
#include "photosphere/volume/grid.h"

namespace photosphere::volume {

/// Voxels of a grid that hold what a coefficient cannot be.
struct InvalidValues {
  std::uint64_t nans = 0;
  std::uint64_t infinities = 0;  ///< beyond what a float holds, too
  std::uint64_t negatives = 0;
  Vec3i first{0};         ///< index of the first of them, in the order of the tree
  double firstValue = 0;  ///< there
  double largest = 0;     ///< of the values that are valid, by the largest component; 0 without any

  std::uint64_t total() const { return nans + infinities + negatives; }
  /// `2 NaN, 1 infinite and 0 negative values, the first (nan) at voxel (1, 2, 3)`.
  std::string text() const;
};

/// Counts over the active voxels of a scalar or vector grid; a vector counts once, by its worst
/// component. Tiles count with all their voxels.
/// @param negatives  whether values below zero are invalid
/// @throws InputError for a grid of another kind
InvalidValues findInvalid(const Grid& grid, bool negatives);

/// A copy in which those values are 0 (all components of a vector). @throws as findInvalid
Grid withInvalidAsZero(const Grid& grid, bool negatives);

}  // namespace photosphere::volume
