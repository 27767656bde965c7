#pragma once
// What the eye sees of a place in the smoke: the weight of Smoothing::visible.

#include "photosphere/core/rng.h"
#include "photosphere/estimators/inscatter.h"
#include "photosphere/transport/support_lattice.h"

namespace photosphere::estimators {

/// A march asks for the mean of fluence phi under the weight w = sigma_t T, T = transmittance
/// toward the eye. Where a light voxel is many mean free paths deep the mean over its volume is
/// another, so photons deposit w phi there, and the lookup divides by the mean of w (an estimator
/// of the ratio that METHOD.md, section 5.3, takes for w = sigma_t). T is that from a point through
/// its own voxel and two voxel edges beyond: a factor that a whole voxel shares cancels.
/// Thread-safe; holds references.
class VisibleWeight {
 public:
  VisibleWeight(const transport::Medium& medium, const transport::SupportLattice& lattice,
                const View& view)
      : m_medium(medium), m_lattice(lattice), m_view(view) {}

  /// w at a point of a voxel, times the voxel's edge [1]; 0 where less than 1/1000 of it is seen.
  float at(std::size_t voxel, const Vec3f& p) const;
  /// Mean of the same over the voxel; 0 where hardly any of it is seen.
  float mean(std::size_t voxel) const;

 private:
  // Way from `p` along `d` until it leaves the voxel [m].
  float wayOut(std::size_t voxel, const Vec3f& p, const Vec3f& d) const;
  // Beyond a voxel [m].
  float beyond() const { return 2.0f * static_cast<float>(m_lattice.edge()); }
  // Way from `p` to the eye along the direction to it, or all but that; endless without an eye [m].
  float wayToEye(const Vec3f& p, const Vec3f& d) const;
  // Optical depth, summed up to where it is opaque.
  float depth(const Vec3f& p, const Vec3f& d, float length) const;
  // Hands on steps along a line: where each begins, its length and its optical depth, at most
  // `stepDepth` in smoke that thickens no faster than it can. Ends when `visit` returns false.
  template <class Visit>
  void walk(const Vec3f& p, const Vec3f& d, float length, float stepDepth,
            const Visit& visit) const;
  // A voxel's own random numbers.
  Rng linesOf(std::size_t voxel) const;
  // Means of a voxel that lines to the eye pass all but parallel, and of one near the eye.
  float meanFromAfar(std::size_t voxel) const;
  float meanNearby(std::size_t voxel) const;

  const transport::Medium& m_medium;
  const transport::SupportLattice& m_lattice;
  const View& m_view;
};

}  // namespace photosphere::estimators
