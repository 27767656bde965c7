// Kernels over directions: closed forms, energy, and convolution against brute force.
#include "photosphere/sphere/smoothing.h"

#include <cmath>

#include "photosphere/core/error.h"
#include "photosphere/core/rng.h"
#include "photosphere/core/sampling.h"
#include "photosphere/sphere/zonal.h"
#include "support/support.h"

namespace photosphere::sphere {
namespace {

double henyeyGreenstein(double g, double cosine) {
  return (1 - g * g) / (4 * kPi * std::pow(1 + g * g - 2 * g * cosine, 1.5));
}

// Henyey-Greenstein's, up to where they are nothing.
LegendreMoments momentsOf(double g) {
  LegendreMoments moments{1.0};
  for (double m = g; std::abs(m) >= 1e-7; m *= g)
    moments.push_back(m);
  return moments;
}

// Unit direction at an angle from +z.
Vec3f tilted(double angle) {
  return Vec3f(Vec3d(std::sin(angle), 0, std::cos(angle)));
}

TEST(Angles, HaveTheirDigitsAtBothEnds) {
  Rng rng(RandomKey::fromSeed(1, 0), RandomStream::test, 0);
  for (int i = 0; i < 20000; ++i) {
    const Vec3f a = sampleSphere(rng.uniform2());
    const Vec3f b = i % 2 ? sampleSphere(rng.uniform2())
                          : glm::normalize((i % 4 ? 1.0f : -1.0f) * a +
                                           rng.uniform() * 0.01f * sampleSphere(rng.uniform2()));
    const Vec3d x(a), y(b);
    const Vec3d cross(x.y * y.z - x.z * y.y, x.z * y.x - x.x * y.z, x.x * y.y - x.y * y.x);
    ASSERT_NEAR(static_cast<double>(angleBetween(a, b)),
                std::atan2(glm::length(cross), glm::dot(x, y)), 1e-6);
  }
  EXPECT_EQ(angleBetween({0, 0, 1}, {0, 0, 1}), 0.0f);
  EXPECT_NEAR(angleBetween({0, 0, 1}, {0, 0, -1}), kPiF, 1e-6f);
  EXPECT_NEAR(angleBetween({0, 0, 1}, tilted(1e-4)), 1e-4f, 1e-9f);
}

struct KernelCase {
  AngularKernel kind;
  double bandwidth, truncation;
};
class Kernels : public ::testing::TestWithParam<KernelCase> {};

// Rings about the centre, from the definition of the area element alone.
TEST_P(Kernels, IntegrateToOneOverTheSphere) {
  const auto [kind, bandwidth, truncation] = GetParam();
  const SmoothingKernel kernel(kind, bandwidth, truncation);
  const double end = static_cast<double>(kernel.support());
  constexpr int n = 20000;
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const double t = (i + 0.5) * end / n;
    sum += static_cast<double>(kernel.atAngle(static_cast<float>(t))) * 2 * kPi * std::sin(t) *
           end / n;
  }
  EXPECT_NEAR(sum, 1.0, 2e-6);
  EXPECT_LE(end, kPi + 1e-6);
  EXPECT_EQ(kernel.atAngle(kernel.support() * 1.0001f + 1e-6f), 0.0f);
}

// Errata 4: no kernel gains or loses energy, into any number of directions.
TEST_P(Kernels, RestoreTheEnergyOfEveryBin) {
  const auto [kind, bandwidth, truncation] = GetParam();
  const SmoothingKernel kernel(kind, bandwidth, truncation);
  for (const int rows : {1, 2, 3})
    for (const int restored : {1, 2, 4}) {
      const Partition bins(rows), cells(restored);
      const auto m = smoothingMatrix(bins, cells, kernel);
      const auto columns = static_cast<std::size_t>(bins.size());
      for (std::size_t j = 0; j < columns; ++j) {
        double sum = 0;
        for (std::size_t k = j; k < m.size(); k += columns) {
          ASSERT_GE(m[k], 0.0);
          sum += m[k];
        }
        ASSERT_NEAR(sum, 1.0, 1e-12) << rows << " to " << restored;
      }
    }
}

// The convolution of a phase function with the kernel, against points all over the sphere.
TEST_P(Kernels, ConvolveWithAPhaseFunction) {
  const auto [kind, bandwidth, truncation] = GetParam();
  const SmoothingKernel kernel(kind, bandwidth, truncation);
  const double g = 0.6;
  const LegendreMoments phase = momentsOf(g);
  const ZonalTable table(convolved(phase, kernelMoments(kernel, phase.size())));
  const Partition points(150);
  for (const double angle : {0.0, 0.3, 1.2, 2.5, kPi}) {
    double expected = henyeyGreenstein(g, std::cos(angle));  // of a kernel that points cannot show
    if (bandwidth >= 0.05) {
      double sum = 0, norm = 0;
      for (int i = 0; i < points.size(); ++i) {
        const Vec3f w = points.center(i);
        const auto k = static_cast<double>(kernel(w, tilted(angle)));
        norm += k;
        sum += k * henyeyGreenstein(g, static_cast<double>(w.z));
      }
      ASSERT_NEAR(norm * static_cast<double>(points.cellArea()), 1.0, 0.02);
      expected = sum / norm;
    }
    EXPECT_NEAR(static_cast<double>(table.atAngle(static_cast<float>(angle))) / expected, 1.0, 0.01)
        << angle;
  }
}

INSTANTIATE_TEST_SUITE_P(Sphere, Kernels,
                         ::testing::Values(KernelCase{AngularKernel::gaussian, 0.5, 3},
                                           KernelCase{AngularKernel::gaussian, 0.5, 1.5},
                                           KernelCase{AngularKernel::gaussian, 0.5, 1},
                                           KernelCase{AngularKernel::gaussian, 0.01, 9},
                                           KernelCase{AngularKernel::gaussian, 2.0, 3},
                                           KernelCase{AngularKernel::gaussian, 50.0, 1e6},
                                           KernelCase{AngularKernel::epanechnikov, 0.5, 3},
                                           KernelCase{AngularKernel::epanechnikov, 0.8, 0.5},
                                           KernelCase{AngularKernel::epanechnikov, 4.0, 1},
                                           KernelCase{AngularKernel::epanechnikov, 0.002, 1}));

// Narrow kernels have the plane's height; a cut one is raised by what it lost: a planar gaussian
// holds 1 - exp(-x^2 / 2) within x sigma, 0.675 at 1.5 and 0.393 at 1.
TEST(Kernel, IsThePlanesWhereNarrow) {
  constexpr double h = 0.01;
  const SmoothingKernel gaussian(AngularKernel::gaussian, h, 9);
  EXPECT_NEAR(static_cast<double>(gaussian.atAngle(0)) * 2 * kPi * h * h, 1.0, 1e-4);
  const SmoothingKernel epanechnikov(AngularKernel::epanechnikov, h, 1);
  EXPECT_NEAR(static_cast<double>(epanechnikov.atAngle(0)) * kPi * h * h / 2, 1.0, 1e-4);
  for (const double cut : {1.0, 1.5}) {
    const SmoothingKernel truncated(AngularKernel::gaussian, h, cut);
    EXPECT_NEAR(static_cast<double>(gaussian.atAngle(0) / truncated.atAngle(0)),
                1 - std::exp(-cut * cut / 2), 1e-4);
  }
}

TEST(Kernel, IsEvenWhereWide) {
  const SmoothingKernel wide(AngularKernel::gaussian, 1000, 1000);
  EXPECT_NEAR(static_cast<double>(wide.atAngle(0)) * 4 * kPi, 1.0, 1e-5);
  const Partition bins(2), cells(3);
  for (const double share : smoothingMatrix(bins, cells, wide))
    EXPECT_NEAR(share * cells.size(), 1.0, 1e-5);
}

// With no kernel, or one that reaches nothing, light stays where it was.
TEST(Kernel, LeavesLightInPlaceWhereItDoesNotReach) {
  const Partition bins(2), cells(4);
  const auto same = smoothingMatrix(bins, bins, {});
  const auto narrow = smoothingMatrix(bins, cells, {AngularKernel::epanechnikov, 0.001, 1});
  const auto even = smoothingMatrix(bins, cells, {});
  for (int j = 0; j < bins.size(); ++j)
    for (int k = 0; k < cells.size(); ++k) {
      const auto at = static_cast<std::size_t>(k * bins.size() + j);
      ASSERT_EQ(narrow[at], k == cells.index(bins.center(j)) ? 1.0 : 0.0);
      if (k < bins.size()) {
        ASSERT_EQ(same[at], k == j ? 1.0 : 0.0);
      }
      // Four cells lie in a bin's area, some of them across its border.
      ASSERT_LE(even[at], 0.25 + 1e-9);
      if (even[at] > 0) {
        ASSERT_EQ(bins.octant(j), cells.octant(k));
      }
    }
}

TEST(Kernel, RefusesWhatHasNoArea) {
  EXPECT_THROW(SmoothingKernel(AngularKernel::gaussian, 0, 3), ConfigError);
  EXPECT_THROW(SmoothingKernel(AngularKernel::gaussian, -1, 3), ConfigError);
  EXPECT_THROW(SmoothingKernel(AngularKernel::gaussian, NAN, 3), ConfigError);
  EXPECT_THROW(SmoothingKernel(AngularKernel::epanechnikov, 0.5, 0), ConfigError);
  EXPECT_FALSE(SmoothingKernel(AngularKernel::none, 0, 0).acts());
}

TEST(ZonalTables, HaveTheFunctionThatTheirMomentsAreOf) {
  for (const double g : {0.0, 0.4, -0.7, 0.9, 0.98, 0.99}) {
    const ZonalTable table(momentsOf(g));
    for (double t = 0; t <= kPi; t += 0.01) {
      const double exact = henyeyGreenstein(g, std::cos(t));
      ASSERT_NEAR(static_cast<double>(table.atAngle(static_cast<float>(t))), exact,
                  2e-3 * exact + 2e-4 / (4 * kPi))
          << g << ' ' << t;
    }
  }
}

// Any kernel leaves an isotropic phase function as it is, to the last bit.
TEST(Moments, IsotropicStaysIsotropic) {
  const auto phase = momentsOf(0);
  EXPECT_EQ(phase.size(), 1u);
  const SmoothingKernel kernel(AngularKernel::gaussian, 0.5, 3);
  const ZonalTable table(convolved(phase, kernelMoments(kernel, phase.size())));
  for (float t : {0.0f, 1.0f, kPiF})
    EXPECT_EQ(table.atAngle(t), static_cast<float>(1 / (4 * kPi)));
}

TEST(Lobes, ConvolveToHenyeyGreenstein) {
  for (const double g : {0.0, 0.5, -0.6, 0.9}) {
    const LobeTable lobes(momentsOf(g));
    for (const double r : {0.0, 0.2, 0.77, 0.95, 1.0})
      for (const double t : {0.0, 0.2, 1.0, 2.0, kPi}) {
        const double exact = henyeyGreenstein(g * r, std::cos(t));
        EXPECT_NEAR(static_cast<double>(lobes(static_cast<float>(r), {0, 0, 1}, tilted(t))) / exact,
                    1.0, 0.01)
            << g << ' ' << r << ' ' << t;
      }
  }
}

// Value over its mean of a series, at a cosine.
double valueOf(const LegendreMoments& moments, double c) {
  double sum = 0;
  for (std::size_t l = 0; l < moments.size(); ++l)
    sum += static_cast<double>(2 * l + 1) * moments[l] * std::legendre(static_cast<unsigned>(l), c);
  return sum;
}

TEST(CutSeries, DipsNoDeeperThanItMay) {
  for (const double g : {0.7, -0.85, 0.95, 0.9999})
    for (const int order : {1, 2, 4, 8})
      for (const double dip : {0.0, 0.1, 0.5}) {
        const LegendreMoments cut = cutAt(momentsOf(g), order, dip);
        ASSERT_EQ(cut.size(), static_cast<std::size_t>(order) + 1);
        EXPECT_EQ(cut[0], 1.0);
        double least = 1;
        for (int i = 0; i <= 2000; ++i)
          least = std::min(least, valueOf(cut, std::cos(kPi * i / 2000)));
        EXPECT_GE(least, -dip - 1e-3) << g << ' ' << order;
        // No more than it takes.
        if (cut[1] != g) {
          EXPECT_NEAR(least, -dip, 1e-3) << g << ' ' << order;
        }
        // Diffusion: the logarithm of what is left of a degree is -t l (l + 1).
        const double t = -std::log(cut[1] / g) / 2;
        for (std::size_t l = 1; l < cut.size(); ++l)
          EXPECT_NEAR(-std::log(cut[l] / std::pow(g, static_cast<double>(l))),
                      t * static_cast<double>(l * (l + 1)), 1e-9);
      }
}

TEST(CutSeries, IsAsItIsWhereItHardlyDips) {
  for (const auto& [g, order] : {std::pair{0.0, 4}, {0.4, 2}, {0.7, 8}, {-0.5, 4}}) {
    const LegendreMoments cut = cutAt(momentsOf(g), order, 0.1);
    for (std::size_t l = 0; l < cut.size(); ++l)
      EXPECT_NEAR(cut[l], l == 0 ? 1.0 : std::pow(g, static_cast<double>(l)), 1e-6) << g;
  }
}

}  // namespace
}  // namespace photosphere::sphere
