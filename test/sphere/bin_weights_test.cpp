// Bin-averaged phase functions against brute force, in closed cases and at the seams of the table.
#include "photosphere/sphere/bin_weights.h"

#include <cmath>
#include <vector>

#include "photosphere/core/rng.h"
#include "photosphere/core/sampling.h"
#include "support/support.h"

namespace photosphere::sphere {
namespace {

double lobe(double g, const Vec3d& w, const Vec3d& wo) {
  const double a = std::abs(g), s = g < 0 ? -1 : 1;
  const Vec3d d = wo - s * w;
  const double q = (1 - a) * (1 - a) + a * glm::dot(d, d);
  return (1 - a * a) / (4 * kPi * q * std::sqrt(q));
}

BinWeights::Phase phaseOf(double g) {
  return [g](const Vec3f& w, const Vec3f& wo) { return lobe(g, Vec3d(w), Vec3d(wo)); };
}

std::vector<float> lookUp(const BinWeights& table, const Vec3f& wo) {
  std::vector<float> out(static_cast<std::size_t>(table.size()));
  table.weights(wo, out.data());
  return out;
}

// Means over all cells by midpoints that are even in sqrt(1 - |z|): unlike points that are even by
// area they lie as densely at the pole as elsewhere.
std::vector<double> bruteForce(const Partition& partition, double g, const Vec3f& wo, int side) {
  std::vector<double> means;
  for (int cell = 0; cell < partition.size(); ++cell) {
    const int row = static_cast<int>(std::sqrt(partition.mirrored(cell) + 0.5));
    double sum = 0, weights = 0;
    for (int i = 0; i < side; ++i) {
      const double s = row + (i + 0.5) / side, u = (s * s - row * row) / (2 * row + 1);
      for (int j = 0; j < side; ++j)
        sum += s * lobe(g, Vec3d(partition.point(cell, {u, (j + 0.5) / side})), Vec3d(wo));
      weights += s * side;
    }
    means.push_back(sum / weights);
  }
  return means;
}

struct WeightSetting {
  int rows;
  double g;
};

class Weights : public ::testing::TestWithParam<WeightSetting> {};

// At nodes of the lattice no interpolation acts: quadrature alone, to 0.1 % of every weight.
TEST_P(Weights, AreBinAveragesAtTheNodes) {
  const auto [rows, g] = GetParam();
  const Partition partition(rows);
  const BinWeights table(partition, phaseOf(g), g);
  const int n = table.latticeSize();
  const std::vector<Vec3d> nodes{{0, 0, n},
                                 {n, 0, 0},
                                 {n / 3, n / 3, n - 2 * (n / 3)},
                                 {n / 2, 1, n - n / 2 - 1},
                                 {1, 0, n - 1}};
  for (Vec3d node : nodes)
    for (const Vec3d& sign : {Vec3d(1, 1, 1), Vec3d(-1, 1, -1)}) {
      const Vec3f wo(glm::normalize(node * sign));
      const auto expected = bruteForce(partition, g, wo, 240 / rows);
      const auto actual = lookUp(table, wo);
      for (std::size_t j = 0; j < actual.size(); ++j)
        ASSERT_NEAR(static_cast<double>(actual[j]) / expected[j], 1.0, 1e-3)
            << "bin " << j << " node " << node.x << ' ' << node.y;
    }
}

// Between the nodes: the error that interpolation leaves, against the root mean square weight.
TEST_P(Weights, InterpolateWithinOnePercent) {
  const auto [rows, g] = GetParam();
  const Partition partition(rows);
  const BinWeights table(partition, phaseOf(g), g);
  Rng rng(RandomKey::fromSeed(4, 0), RandomStream::test, 0);
  double error = 0, norm = 0;
  for (int i = 0; i < 10; ++i) {
    const Vec3f wo = sampleSphere(rng.uniform2());
    const auto expected = bruteForce(partition, g, wo, 160 / rows);
    const auto actual = lookUp(table, wo);
    for (std::size_t j = 0; j < actual.size(); ++j) {
      const double d = static_cast<double>(actual[j]) - expected[j];
      error += d * d;
      norm += expected[j] * expected[j];
    }
  }
  RecordProperty("relative_error", std::to_string(std::sqrt(error / norm)));
  EXPECT_LT(std::sqrt(error / norm), 0.01);
}

TEST_P(Weights, SumToOneInEveryDirection) {
  const auto [rows, g] = GetParam();
  const Partition partition(rows);
  const BinWeights table(partition, phaseOf(g), g);
  Rng rng(RandomKey::fromSeed(5, 0), RandomStream::test, 0);
  for (int i = 0; i < 2000; ++i) {
    double sum = 0;
    for (float w : lookUp(table, sampleSphere(rng.uniform2()))) {
      ASSERT_GT(w, 0.0f);
      sum += static_cast<double>(w);
    }
    ASSERT_NEAR(sum * 4 * kPi / partition.size(), 1.0, 2e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(Sphere, Weights,
                         ::testing::Values(WeightSetting{1, 0.4}, WeightSetting{1, 0.9},
                                           WeightSetting{2, 0.0}, WeightSetting{2, 0.7},
                                           WeightSetting{2, -0.7}, WeightSetting{3, 0.5},
                                           WeightSetting{2, 0.95}, WeightSetting{4, 0.9},
                                           WeightSetting{4, -0.95}));

// A uniform histogram scatters to 1 / (4 pi), and an isotropic phase has equal weights.
TEST(BinWeights, OfAnIsotropicPhaseAreEqual) {
  const BinWeights table(Partition(3), phaseOf(0), 0);
  for (float w : lookUp(table, Vec3f(0.36f, -0.48f, 0.8f)))
    EXPECT_NEAR(w, 1 / (4 * kPi), 1e-7);
}

TEST(BinWeights, AreContinuousAndFiniteAtSeams) {
  const BinWeights table(Partition(2), phaseOf(0.8), 0.8);
  const float e = 1e-6f;
  const std::vector<Vec3f> seams{{1, 0, 0}, {0, -1, 0}, {0, 0, 1},        {0, 0, -1},
                                 {1, 1, 0}, {-1, 0, 1}, {0, 0.3f, -0.7f}, {0.2f, 0.5f, 0},
                                 {1, 1, 1}, {1, 2, -5}, {-0.0f, 3, -0.0f}};
  for (const Vec3f& seam : seams) {
    const Vec3f w = glm::normalize(seam);
    const auto at = lookUp(table, w);
    for (const Vec3f& step :
         {Vec3f(e, e, -e), Vec3f(-e, e, e), Vec3f(e, -e, e), Vec3f(-e, -e, -e)}) {
      const auto near = lookUp(table, glm::normalize(w + step));
      for (std::size_t j = 0; j < at.size(); ++j) {
        ASSERT_TRUE(std::isfinite(at[j]));
        ASSERT_NEAR(near[j], at[j], 1e-4f) << seam.x << ' ' << seam.y << ' ' << seam.z;
      }
    }
  }
  EXPECT_EQ(lookUp(table, Vec3f(0)), lookUp(table, Vec3f(0, 0, 1)));
}

TEST(BinWeights, StayFiniteForExtremeLobes) {
  for (double g : {0.999, -0.9999}) {
    const BinWeights table(Partition(2), phaseOf(g), g);
    double sum = 0;
    for (float w : lookUp(table, glm::normalize(Vec3f(1, 2, 3)))) {
      ASSERT_TRUE(std::isfinite(w));
      sum += static_cast<double>(w);
    }
    EXPECT_NEAR(sum * 4 * kPi / table.size(), 1.0, 1e-5);
  }
}

}  // namespace
}  // namespace photosphere::sphere
