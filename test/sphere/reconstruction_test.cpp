// The smooth reconstruction of a histogram against a closed form.

#include <gtest/gtest.h>

#include <cmath>

#include "photosphere/sphere/bin_weights.h"

namespace photosphere::test {

namespace {

using sphere::BinWeights;
using sphere::Partition;
using sphere::Reconstruction;

double henyeyGreenstein(double g, double cosine) {
  return (1 - g * g) / (4 * kPi * std::pow(1 + g * g - 2 * g * cosine, 1.5));
}

BinWeights::Phase phaseOf(double g) {
  return [g](const Vec3f& w, const Vec3f& wo) {
    return henyeyGreenstein(g, static_cast<double>(glm::dot(w, wo)));
  };
}

// Light that is itself a Henyey-Greenstein lobe about an axis, as a histogram of fluence.
std::vector<double> lobeHistogram(const Partition& bins, double g, const Vec3f& axis) {
  std::vector<double> fluence(static_cast<std::size_t>(bins.size()), 0.0);
  constexpr int n = 24;
  for (int cell = 0; cell < bins.size(); ++cell)
    for (int i = 0; i < n * n; ++i) {
      const Vec3f w = bins.point(cell, Vec2d(i % n + 0.5, i / n + 0.5) / static_cast<double>(n));
      fluence[static_cast<std::size_t>(cell)] +=
          henyeyGreenstein(g, static_cast<double>(glm::dot(w, axis))) *
          static_cast<double>(bins.cellArea()) / (n * n);
    }
  return fluence;
}

// Root mean square error, over directions, of the scattered light, relative to its mean 1 / (4 pi).
double scatteredError(const Partition& bins, Reconstruction reconstruction, double g,
                      double lightG) {
  const BinWeights weights(bins, phaseOf(g), g, reconstruction);
  const Vec3f axis = glm::normalize(Vec3f(0.3f, -0.5f, 0.8f));
  const std::vector<double> fluence = lobeHistogram(bins, lightG, axis);
  std::vector<float> w(static_cast<std::size_t>(bins.size()));
  const Partition directions(5);
  double sum = 0;
  for (int i = 0; i < directions.size(); ++i) {
    const Vec3f wo = directions.center(i);
    weights.weights(wo, w.data());
    double light = 0;
    for (std::size_t j = 0; j < w.size(); ++j)
      light += static_cast<double>(w[j]) * fluence[j];
    // Lobes convolve to a lobe: their Legendre moments g^l multiply.
    const double exact = henyeyGreenstein(g * lightG, static_cast<double>(glm::dot(wo, axis)));
    sum += (light - exact) * (light - exact);
  }
  return std::sqrt(sum / directions.size()) * 4 * kPi;
}

TEST(Reconstruction, SmoothLowersTheErrorOfPeakedLight) {
  for (const int rows : {2, 4})
    for (const double g : {0.3, 0.7}) {
      const Partition bins(rows);
      const double constant = scatteredError(bins, Reconstruction::constant, g, 0.6);
      const double smooth = scatteredError(bins, Reconstruction::smooth, g, 0.6);
      std::printf("  %d bins, g %.1f: constant %.4f, smooth %.4f\n", bins.size(), g, constant,
                  smooth);
      EXPECT_LT(smooth, 0.7 * constant) << rows << " rows, g " << g;
    }
}

TEST(Reconstruction, EvenLightStaysEvenAndEnergyStays) {
  for (const int rows : {1, 2, 3}) {
    const Partition bins(rows);
    const BinWeights weights(bins, phaseOf(0.6), 0.6, Reconstruction::smooth);
    std::vector<float> w(static_cast<std::size_t>(bins.size()));
    const Partition directions(8);
    std::vector<double> total(w.size(), 0.0);
    for (int i = 0; i < directions.size(); ++i) {
      weights.weights(directions.center(i), w.data());
      double even = 0;
      for (std::size_t j = 0; j < w.size(); ++j) {
        even += static_cast<double>(w[j] * bins.cellArea());
        total[j] += static_cast<double>(w[j] * directions.cellArea());
      }
      EXPECT_NEAR(even, 1.0, 0.015);
    }
    // What one bin's light scatters into all directions together.
    for (const double t : total)
      EXPECT_NEAR(t, 1.0, 0.01);
  }
}

}  // namespace

}  // namespace photosphere::test
