#pragma once
// Velocities of smoke, from grids and from particles.

#include <cstdint>
#include <string>

#include "photosphere/core/types.h"
#include "photosphere/volume/grid.h"
#include "photosphere/volume/particle_set.h"
#include "photosphere/volume/rasterize.h"

namespace photosphere::volume {

/// A velocity grid made ready for lookups: components of a staggered (MAC) grid are brought from
/// the voxels' lower faces to their centres, and the field goes on beyond its active voxels with
/// the mean of the neighbours, so that what moves out of them keeps its speed.
/// @param linear  multiplies every vector: the turn and scale from the file's space to where it is
///                looked up
/// @param margin  voxels to go on for, >= 0
/// @return a vec3s grid of the same transform
/// @throws InputError when the grid holds no vectors, or a value that is not finite (naming the
///         first such voxel)
Grid velocityForLookups(const Grid& grid, const Mat3d& linear, int margin, const std::string& path);

/// Particles whose velocity is no number or beyond what a float holds.
struct InvalidVelocities {
  std::uint64_t count = 0;
  std::uint64_t first = 0;  ///< number of the first of them, from 0
};

/// Counts them. None where the particles have no such attribute of three numbers.
InvalidVelocities findInvalidVelocities(const ParticleSet& particles, const std::string& attribute);

/// Mean velocity of particles, weighted by mass and kernel, on the voxels of the density that
/// `rasterize` makes of them with the same options. Those of an invalid velocity count for nothing:
/// voxels that they alone reach are left out.
/// @param attribute  of three numbers a particle [scene units/s]
/// @return a vec3s grid of that name; empty handle when no particle lies anywhere
/// @throws ConfigError, MemoryError as rasterize; InputError for an attribute that is missing or
///         has another size
Grid velocityOfParticles(const ParticleSet& particles, const std::string& attribute,
                         const RasterizeOptions& options, const std::string& path);

}  // namespace photosphere::volume
