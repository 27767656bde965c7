#pragma once
// What is seen of a place in the smoke: the weight of Smoothing::visible.

#include "photosphere/core/rng.h"
#include "photosphere/estimators/light_field.h"
#include "photosphere/transport/support_lattice.h"

namespace photosphere::estimators {

/// A march asks for the mean of fluence phi under the weight w = sigma_t T, T = transmittance
/// toward the eye. Where a light voxel is many mean free paths deep the mean over its volume is
/// another, so photons deposit w phi there, and the lookup divides by the mean of w (an estimator
/// of the ratio that METHOD.md, section 5.3, takes for w = sigma_t). T is that from a point through
/// its own voxel and two voxel edges beyond: a factor that a whole voxel shares cancels. A basis
/// that serves every camera takes the mean of T over all directions, one of which is drawn for each
/// photon, and adds a little everywhere: inside opaque smoke, where a camera may be too, all places
/// count alike. Thread-safe; holds references.
class VisibleWeight {
 public:
  VisibleWeight(const transport::Medium& medium, const transport::SupportLattice& lattice,
                const LightFieldLayout& layout, const View& view)
      : m_medium(medium),
        m_lattice(lattice),
        m_view(layout.basis == Basis::view ? &view : nullptr),
        m_everywhere(m_view ? 0.0f : kEverywhere) {}

  /// Whether `at` looks in a random direction.
  bool looksAllRound() const { return !m_view; }
  /// w at a point of a voxel, times the voxel's edge [1]; toward an eye 0 where less than 1/1000 of
  /// it is seen. @param u  uniform in [0, 1)^2: the direction, if it looks all round
  float at(std::size_t voxel, const Vec3f& p, const Vec2f& u) const;
  /// Mean of the same over the voxel; toward an eye 0 where hardly any of it is seen.
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
  // Of sigma_t T over a voxel, times its edge, and of the same with T from where a line leaves it.
  struct Mean {
    float seen = 0.0f, open = 0.0f;
  };
  // Where lines toward the eye are all but parallel, and near the eye.
  Mean meanFromAfar(std::size_t voxel, const Vec3f& toEye, double lines, Rng& rng) const;
  Mean meanNearby(std::size_t voxel, Rng& rng) const;

  const transport::Medium& m_medium;
  const transport::SupportLattice& m_lattice;
  const View* m_view;  // null = all round
  float m_everywhere;

  // Of an opaque voxel's weight at a flat face, which is about a quarter whatever its depth.
  static constexpr float kEverywhere = 0.002f;
};

}  // namespace photosphere::estimators
