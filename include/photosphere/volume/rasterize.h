#pragma once
// Particles to density, and density to particles.

#include <cstdint>

#include "photosphere/volume/grid.h"
#include "photosphere/volume/particle_set.h"

namespace photosphere::volume {

struct RasterizeOptions {
  double voxelSize = 0;  ///< edge [scene units]; 0 = half the median particle radius
  double radius = 0;     ///< one radius for all [scene units]; 0 = `pscale`, else from spacing
};

struct RasterizeResult {
  Grid density;          ///< float grid `density`: mass over volume
  double voxelSize = 0;  ///< as chosen [scene units]
  double radiusMin = 0, radiusMedian = 0, radiusMax = 0;
  bool radiusFromSpacing = false;
  double spacing = 0;        ///< median distance to the nearest neighbour (0 when radius was given)
  double massParticles = 0;  ///< sum over the particles
  double massGrid = 0;       ///< sum of density times voxel volume
  std::uint64_t skipped =
      0;  ///< particles with a position, radius or mass that is not finite or < 0
};

/// Mass of a particle: `mass`, else density * 4/3 pi pscale^3, else 1 (SCENE.md, volume.file).
/// Spreads it over the voxel centres within `radius` by an Epanechnikov kernel that is normalised
/// over those voxels (sum of weights 1), the nearest voxel taking all when none lies inside. The
/// result does not depend on the number of threads.
/// @throws ConfigError for a negative option; MemoryError when the voxels would exceed the budget
RasterizeResult rasterize(const ParticleSet& particles, const RasterizeOptions& options);

/// Median distance from a particle to its nearest other, over at most 20,000 particles spread
/// evenly.
double medianSpacing(const ParticleSet& particles);

/// Seeds `count` particles in proportion to a density grid's mass: stratified over the voxels,
/// jittered inside them, each with `mass` (equal shares), `pscale` from spacing and `density`.
ParticleSet seedParticles(const Grid& density, std::uint64_t count, std::uint64_t seed);

}  // namespace photosphere::volume
