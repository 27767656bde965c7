#pragma once
// Real spherical harmonics, the basis of light that varies slowly with direction.

#include <array>

#include "photosphere/core/types.h"

namespace photosphere::sphere {

/// Real spherical harmonics up to an order, orthonormal over the sphere, without Condon-Shortley
/// phase. Immutable; thread-safe; same bits on every CPU.
class SphericalHarmonics {
 public:
  static constexpr int kMaxOrder = 8;
  static constexpr int kMaxCount = (kMaxOrder + 1) * (kMaxOrder + 1);

  /// @throws ConfigError for an order outside 0 to kMaxOrder
  explicit SphericalHarmonics(int order);

  int order() const { return m_order; }
  /// (order + 1)^2.
  int count() const { return (m_order + 1) * (m_order + 1); }
  /// Place of Y_lm: l^2 + l + m, -l <= m <= l.
  static constexpr int index(int l, int m) { return l * l + l + m; }
  /// Degree l of the harmonic at a place.
  static constexpr int degree(int index) {
    int l = 0;
    while ((l + 1) * (l + 1) <= index)
      ++l;
    return l;
  }

  /// All harmonics in a direction. @param w  unit  @param y  `count` values [sr^-1/2]
  void evaluate(const Vec3f& w, float* y) const;

 private:
  int m_order;
  // Norm of Y_lm, m >= 0, with the factor sqrt 2 of m > 0.
  std::array<float, static_cast<std::size_t>(kMaxCount)> m_norm{};
};

}  // namespace photosphere::sphere
