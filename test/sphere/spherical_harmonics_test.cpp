// Spherical harmonics: orthonormal, and what they make of phase functions.

#include "photosphere/sphere/spherical_harmonics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "photosphere/core/error.h"
#include "photosphere/core/rng.h"
#include "photosphere/core/sampling.h"

namespace photosphere::test {

namespace {

using sphere::SphericalHarmonics;

// Directions and weights that integrate polynomials up to degree 23 exactly: Gauss-Legendre in z
// (nodes by Newton's method), even steps around it.
struct Quadrature {
  std::vector<Vec3d> directions;
  std::vector<double> weights;
  Quadrature() {
    constexpr int n = 12, around = 24;
    for (int i = 0; i < n; ++i) {
      double z = std::cos(kPi * (i + 0.75) / (n + 0.5)), slope = 1;
      for (int step = 0; step < 20; ++step) {
        double p = 1, before = 0;
        for (int l = 0; l < n; ++l) {
          const double next = ((2 * l + 1) * z * p - l * before) / (l + 1);
          before = p;
          p = next;
        }
        slope = n * (z * p - before) / (z * z - 1);
        z -= p / slope;
      }
      for (int k = 0; k < around; ++k) {
        const double phi = 2 * kPi * k / around, s = std::sqrt(1 - z * z);
        directions.emplace_back(s * std::cos(phi), s * std::sin(phi), z);
        weights.push_back(2 / ((1 - z * z) * slope * slope) * 2 * kPi / around);
      }
    }
  }
};

Vec3f randomDirection(Rng& rng) {
  return sampleSphere(rng.uniform2());
}

double legendre(int degree, double x) {
  double p = 1, before = 0;
  for (int l = 0; l < degree; ++l) {
    const double next = ((2 * l + 1) * x * p - l * before) / (l + 1);
    before = p;
    p = next;
  }
  return p;
}

TEST(SphericalHarmonics, AreOrthonormal) {
  const SphericalHarmonics harmonics(8);
  const auto n = static_cast<std::size_t>(harmonics.count());
  const Quadrature q;
  std::vector<double> products(n * n);
  std::vector<float> y(n);
  for (std::size_t i = 0; i < q.directions.size(); ++i) {
    harmonics.evaluate(Vec3f(q.directions[i]), y.data());
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = 0; b < n; ++b)
        products[a * n + b] += q.weights[i] * static_cast<double>(y[a]) * static_cast<double>(y[b]);
  }
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b < n; ++b)
      EXPECT_NEAR(products[a * n + b], a == b ? 1.0 : 0.0, 2e-6) << a << " " << b;
}

TEST(SphericalHarmonics, FirstDegreesAreTheFamiliarOnes) {
  const SphericalHarmonics harmonics(2);
  const Vec3f w = glm::normalize(Vec3f(0.3f, -0.7f, 0.5f));
  float y[9];
  harmonics.evaluate(w, y);
  const auto close = [](float value, double exact) {
    EXPECT_NEAR(static_cast<double>(value), exact, 1e-6);
  };
  const Vec3d d(w);
  const double first = std::sqrt(3 / (4 * kPi)), second = 0.5 * std::sqrt(15 / kPi);
  close(y[0], std::sqrt(1 / (4 * kPi)));
  close(y[1], first * d.y);
  close(y[2], first * d.z);
  close(y[3], first * d.x);
  close(y[4], second * d.x * d.y);
  close(y[5], second * d.y * d.z);
  close(y[6], 0.25 * std::sqrt(5 / kPi) * (3 * d.z * d.z - 1));
  close(y[7], second * d.x * d.z);
  close(y[8], 0.5 * second * (d.x * d.x - d.y * d.y));
}

// Sum over m of Y_lm(a) Y_lm(b) = (2l+1)/(4 pi) P_l(a . b): it depends on the angle alone, so
// turning both directions changes nothing.
TEST(SphericalHarmonics, ObeyTheAdditionTheorem) {
  const SphericalHarmonics harmonics(8);
  Rng rng(RandomKey::fromSeed(1, 0), RandomStream::test, 0);
  std::vector<float> ya(81), yb(81);
  for (int i = 0; i < 500; ++i) {
    const Vec3f a = randomDirection(rng), b = randomDirection(rng);
    harmonics.evaluate(a, ya.data());
    harmonics.evaluate(b, yb.data());
    for (int l = 0; l <= 8; ++l) {
      double sum = 0;
      for (int m = -l; m <= l; ++m) {
        const auto at = static_cast<std::size_t>(SphericalHarmonics::index(l, m));
        sum += static_cast<double>(ya[at]) * static_cast<double>(yb[at]);
      }
      const double cosine = glm::dot(Vec3d(a), Vec3d(b));
      EXPECT_NEAR(sum, (2 * l + 1) / (4 * kPi) * legendre(l, cosine), 3e-6) << l;
    }
  }
}

// Weighting degree l by g^l turns the sum into Henyey-Greenstein's lobe, cut at the order; for a
// small g nothing is cut.
TEST(SphericalHarmonics, SumToHenyeyGreenstein) {
  const SphericalHarmonics harmonics(8);
  Rng rng(RandomKey::fromSeed(2, 0), RandomStream::test, 0);
  std::vector<float> ya(81), yb(81);
  for (const double g : {0.0, 0.2, -0.3}) {
    for (int i = 0; i < 200; ++i) {
      const Vec3f a = randomDirection(rng), b = randomDirection(rng);
      harmonics.evaluate(a, ya.data());
      harmonics.evaluate(b, yb.data());
      double sum = 0;
      for (int k = 0; k < 81; ++k)
        sum += std::pow(g, SphericalHarmonics::degree(k)) *
               static_cast<double>(ya[static_cast<std::size_t>(k)]) *
               static_cast<double>(yb[static_cast<std::size_t>(k)]);
      const double cosine = glm::dot(Vec3d(a), Vec3d(b));
      const double exact = (1 - g * g) / (4 * kPi) / std::pow(1 + g * g - 2 * g * cosine, 1.5);
      // What is cut: the sum of (2l+1) |g|^l over l > 8, over 4 pi.
      double cut = 0;
      for (int l = 9; l < 60; ++l)
        cut += (2 * l + 1) * std::pow(std::abs(g), l) / (4 * kPi);
      EXPECT_NEAR(sum, exact, cut + 3e-6) << g;
    }
  }
}

TEST(SphericalHarmonics, KnowTheirOrders) {
  for (int k = 0; k < SphericalHarmonics::kMaxCount; ++k) {
    const int l = SphericalHarmonics::degree(k);
    EXPECT_GE(k, SphericalHarmonics::index(l, -l));
    EXPECT_LE(k, SphericalHarmonics::index(l, l));
  }
  EXPECT_EQ(SphericalHarmonics(0).count(), 1);
  EXPECT_EQ(SphericalHarmonics(8).count(), 81);
  EXPECT_THROW(SphericalHarmonics(9), ConfigError);
  EXPECT_THROW(SphericalHarmonics(-1), ConfigError);
}

}  // namespace

}  // namespace photosphere::test
