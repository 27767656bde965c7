#include "photosphere/sphere/spherical_harmonics.h"

#include <fmt/format.h>

#include <cmath>

#include "photosphere/core/error.h"

namespace photosphere::sphere {

SphericalHarmonics::SphericalHarmonics(int order) : m_order(order) {
  if (order < 0 || order > kMaxOrder)
    throw ConfigError(fmt::format("order = {}: spherical harmonics are served from order 0 to {}",
                                  order, kMaxOrder));
  for (int l = 0; l <= order; ++l) {
    double norm = (2 * l + 1) / (4 * kPi);  // times (l-m)! / (l+m)!
    for (int m = 0; m <= l; ++m) {
      if (m > 0) norm /= static_cast<double>((l + m) * (l - m + 1));
      m_norm[static_cast<std::size_t>(index(l, m))] =
          static_cast<float>(std::sqrt(m > 0 ? 2 * norm : norm));
    }
  }
}

// Polynomials in x, y, z alone: the associated Legendre function over sin^m is one in z, and sin^m
// times cos or sin of m phi is the real or imaginary part of (x + i y)^m.
void SphericalHarmonics::evaluate(const Vec3f& w, float* y) const {
  float real = 1.0f, imaginary = 0.0f, diagonal = 1.0f;
  for (int m = 0; m <= m_order; ++m) {
    float before = 0.0f, legendre = diagonal;
    for (int l = m; l <= m_order; ++l) {
      const float value = m_norm[static_cast<std::size_t>(index(l, m))] * legendre;
      y[index(l, m)] = value * real;
      if (m > 0) y[index(l, -m)] = value * imaginary;
      const float next =
          (static_cast<float>(2 * l + 1) * w.z * legendre - static_cast<float>(l + m) * before) /
          static_cast<float>(l - m + 1);
      before = legendre;
      legendre = next;
    }
    const float turned = real * w.x - imaginary * w.y;
    imaginary = real * w.y + imaginary * w.x;
    real = turned;
    diagonal *= static_cast<float>(2 * m + 1);
  }
}

}  // namespace photosphere::sphere
