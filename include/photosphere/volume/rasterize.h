#pragma once
// Particles to density, and density to particles.

#include <cstdint>
#include <optional>

#include "photosphere/volume/grid.h"
#include "photosphere/volume/particle_set.h"
#include "photosphere/volume/strays.h"

namespace photosphere::volume {

struct RasterizeOptions {
  /// Edge of a voxel [scene units]; 0 = half the median particle radius, but not so small that the
  /// kernels could touch more than 2^28 voxels (1 GiB; counted as the smaller of the kernels'
  /// summed volume and the volume of their bounding box) or that indices would leave 30 bits.
  double voxelSize = 0;
  /// One radius for all [scene units]; 0 = `pscale` when some particle has one above 0, else twice
  /// the median spacing.
  double radius = 0;
  bool leaveOutStrays = false;  ///< see Strays
  Box3d within = {};            ///< particles outside are left out; empty = none [scene units]

  bool takes(const Vec3d& position) const { return within.empty() || within.contains(position); }
};

struct RasterizeResult {
  Grid density;          ///< float grid `density`: mass over volume
  double voxelSize = 0;  ///< as chosen [scene units]
  double radiusMin = 0, radiusMedian = 0, radiusMax = 0;
  bool radiusFromSpacing = false;
  double spacing = 0;        ///< medianSpacing() where the radius came from it, else 0
  double massParticles = 0;  ///< sum over the particles that are rasterized
  double massGrid = 0;       ///< sum of density times voxel volume
  std::uint64_t skipped =
      0;  ///< particles with a position, radius or mass that is not finite or < 0
  std::uint64_t firstSkipped = 0;  ///< number of the first of them, from 0
  std::optional<Strays> strays;    ///< that were left out
};

/// Mass of a particle: `mass`, else density * 4/3 pi r^3 with r its `pscale`, or the radius where
/// the set has none, else 1. Spreads it over the voxel centres within `radius` by an Epanechnikov
/// kernel that is normalised over those voxels (sum of weights 1), the nearest voxel taking all
/// when none lies inside. The result does not depend on the number of threads. Memory besides the
/// set and the grid: about 56 bytes a particle and 16 a (particle, tile) pair, two pairs a particle
/// where the voxel size is the default.
/// @throws ConfigError for a negative option, or a voxel size so small that indices leave 30 bits;
///   MemoryError when pairs and voxels would not fit 80 % of the memory that is free, or when the
///   voxel size is to be chosen and a radius is more than 200 times the median
RasterizeResult rasterize(const ParticleSet& particles, const RasterizeOptions& options);

/// Median distance from a particle to its nearest other, over at most 20,000 particles spread
/// evenly.
double medianSpacing(const ParticleSet& particles);

/// Seeds `count` particles in proportion to a density grid's mass: stratified over the voxels,
/// jittered inside them, each with `mass` (equal shares), `pscale` from spacing and `density`.
ParticleSet seedParticles(const Grid& density, std::uint64_t count, std::uint64_t seed);

}  // namespace photosphere::volume
