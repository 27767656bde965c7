#pragma once
// Particles prepared for rasterising: what is valid of them, in index space.

#include <cstdint>
#include <optional>
#include <vector>

#include "photosphere/volume/rasterize.h"

namespace photosphere::volume {

/// A valid particle before the voxel size is known.
struct Blob {
  Vec3d position;  ///< world space [scene units]
  double radius;   ///< [scene units]
  double mass;
};

/// Valid particles in the set's order; fills the radius, mass and `skipped` fields of `result`.
std::vector<Blob> collectBlobs(const ParticleSet& particles, const RasterizeOptions& options,
                               RasterizeResult& result);

/// Radii of particles, for `result`.
void summarizeRadii(const std::vector<Blob>& blobs, RasterizeResult& result);

/// Strays of them, by their masses.
std::optional<Strays> findStrays(const std::vector<Blob>& blobs);

/// Mass of every particle, valid or not, by the rule of `rasterize`.
std::vector<double> particleMasses(const ParticleSet& particles, const RasterizeOptions& options);

/// The voxel size that the options ask for, or the default rule (RasterizeOptions::voxelSize).
double chooseVoxelSize(const std::vector<Blob>& blobs, const RasterizeOptions& options,
                       double radiusMedian);

/// An Epanechnikov kernel on the lattice of voxel centres (integers).
struct Splat {
  Vec3d center;       ///< index space
  double radius = 0;  ///< [voxels]
  double scale = 0;   ///< mass over the sum of weights; negative: all mass to the nearest voxel

  /// Inclusive box of voxels that it may touch.
  Vec3i first() const { return Vec3i(glm::floor(center - reach() + 0.5)); }
  Vec3i last() const { return Vec3i(glm::floor(center + reach() + 0.5)); }

  /// Calls f(x, y, z, weight) for the voxels inside the radius and inside [lo, hi], in order.
  template <class F>
  void forEachVoxel(const Vec3i& lo, const Vec3i& hi, F&& f) const {
    const double inverse = 1.0 / (radius * radius);
    for (int x = lo.x; x <= hi.x; ++x)
      for (int y = lo.y; y <= hi.y; ++y) {
        const double dx = x - center.x, dy = y - center.y;
        const double left = 1.0 - (dx * dx + dy * dy) * inverse;
        if (!(left > 0)) continue;
        for (int z = lo.z; z <= hi.z; ++z) {
          const double dz = z - center.z;
          const double weight = left - dz * dz * inverse;
          if (weight > 0) f(x, y, z, weight);
        }
      }
  }

 private:
  double reach() const { return radius > 0.5 ? radius : 0.0; }
};

}  // namespace photosphere::volume
