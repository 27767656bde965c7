// The partition: inverse look-up, areas, and the exact cases of poles, edges and signed zeros.
#include "photosphere/sphere/partition.h"

#include <cmath>
#include <set>

#include "photosphere/core/error.h"
#include "photosphere/core/rng.h"
#include "photosphere/core/sampling.h"
#include "support/support.h"

namespace photosphere::sphere {
namespace {

class Rows : public ::testing::TestWithParam<int> {};

TEST_P(Rows, IndexInvertsCentersAndPoints) {
  const Partition partition(GetParam());
  Rng rng(RandomKey::fromSeed(1, 0), RandomStream::test, 0);
  for (int cell = 0; cell < partition.size(); ++cell) {
    EXPECT_NEAR(glm::length(Vec3d(partition.center(cell))), 1.0, 1e-7);
    ASSERT_EQ(partition.index(partition.center(cell)), cell);
    for (int i = 0; i < 50; ++i) {
      // Strictly inside: directions are float, so stay 1e-4 of the cell away from its border.
      const Vec2d u(1e-4 + 0.9998 * rng.uniformDouble(), 1e-4 + 0.9998 * rng.uniformDouble());
      ASSERT_EQ(partition.index(partition.point(cell, u)), cell) << u.x << ' ' << u.y;
    }
    for (double x : {1e-4, 1 - 1e-4})
      for (double y : {1e-4, 1 - 1e-4})
        ASSERT_EQ(partition.index(partition.point(cell, {x, y})), cell) << x << ' ' << y;
  }
}

// Uniform directions fall alike into all cells, and by the definition of rows in z and azimuth.
TEST_P(Rows, CellsHaveEqualAreas) {
  const int n = GetParam();
  const Partition partition(n);
  const int count = 400 * partition.size();
  std::vector<double> hits(static_cast<std::size_t>(partition.size()), 0.0);
  Rng rng(RandomKey::fromSeed(2, 0), RandomStream::test, 0);
  for (int i = 0; i < count; ++i) {
    const Vec3f w = sampleSphere(rng.uniform2());
    const int cell = partition.index(w);
    ASSERT_TRUE(cell >= 0 && cell < partition.size());
    hits[static_cast<std::size_t>(cell)] += 1;
    const int local = partition.mirrored(cell), row = static_cast<int>(std::sqrt(local + 0.5));
    const double s = n * std::sqrt(1 - std::abs(static_cast<double>(w.z)));
    ASSERT_NEAR(s, row + 0.5, 0.5 + 1e-2 / (s + 1e-2)) << "row from z";
  }
  double statistic = 0;
  for (double h : hits)
    statistic += (h - 400) * (h - 400) / 400;
  EXPECT_GT(test::chiSquaredTail(statistic, partition.size() - 1), 1e-4);
  EXPECT_NEAR(partition.cellArea() * static_cast<float>(partition.size()), 4 * kPi, 1e-5);
}

// Exact areas: row i spans ((i+1)^2 - i^2) / n^2 in z, shared by 2 i + 1 cells.
TEST_P(Rows, PointsSpanTheirCellsInEqualParts) {
  const Partition partition(GetParam());
  for (int cell = 0; cell < partition.size(); ++cell) {
    const Vec3d top = partition.point(cell, {0, 0.5}), bottom = partition.point(cell, {1, 0.5});
    const Vec3d left = partition.point(cell, {0.5, 0}), right = partition.point(cell, {0.5, 1});
    const double azimuth = std::atan2(std::abs(right.y), std::abs(right.x)) -
                           std::atan2(std::abs(left.y), std::abs(left.x));
    const double area = (std::abs(top.z) - std::abs(bottom.z)) * azimuth;
    ASSERT_NEAR(area * partition.size() / (4 * kPi), 1.0, 2e-4) << cell;
  }
}

TEST_P(Rows, OctantsMirrorOneAnother) {
  const Partition partition(GetParam());
  Rng rng(RandomKey::fromSeed(3, 0), RandomStream::test, 0);
  for (int i = 0; i < 2000; ++i) {
    const Vec3f w = sampleSphere(rng.uniform2());
    const int cell = partition.index(w);
    EXPECT_EQ(partition.octant(cell), Partition::octantOf(w));
    EXPECT_EQ(partition.index(glm::abs(w)), partition.mirrored(cell));
  }
}

INSTANTIATE_TEST_SUITE_P(Sphere, Rows, ::testing::Range(1, 17));

TEST(Partition, IsExactAtPolesEdgesAndSignedZeros) {
  for (int n = 1; n <= 16; ++n) {
    const Partition p(n);
    const int octant = n * n;
    for (float x : {0.0f, -0.0f})
      for (float y : {0.0f, -0.0f}) {
        EXPECT_EQ(p.index({x, y, 1}), 0);
        EXPECT_EQ(p.index({x, y, -1}), 4 * octant);
        EXPECT_EQ(p.index({x, y, 0.0f}), 0) << "zero vector";
        EXPECT_EQ(p.index({x, y, -0.0f}), 0) << "zero vector";
        // The axes: first and last cell of the lowest row.
        EXPECT_EQ(p.index({1, x, y}), (n - 1) * (n - 1));
        EXPECT_EQ(p.index({-1, x, y}), octant + (n - 1) * (n - 1));
        EXPECT_EQ(p.index({x, 1, y}), octant - 1);
        EXPECT_EQ(p.index({x, -1, y}), 2 * octant + octant - 1);
      }
    // Just off the pole and the equator, where 1 - z has no digits left.
    EXPECT_EQ(p.mirrored(p.index({1e-20f, 1e-20f, 1})), 0);
    EXPECT_EQ(p.octant(p.index({-1e-20f, 1e-20f, -1})), 5);
    EXPECT_EQ(p.octant(p.index(glm::normalize(Vec3f(-1, -1, -1e-20f)))), 7);
  }
}

// Cells far smaller than any histogram has: floats still tell them apart.
TEST(Partition, InvertsFineCells) {
  for (const int n : {64, 255, 1024}) {
    const Partition p(n);
    Rng rng(RandomKey::fromSeed(4, 0), RandomStream::test, 0);
    for (int i = 0; i < 20000; ++i) {
      const int cell = std::min(p.size() - 1, static_cast<int>(rng.uniformDouble() * p.size()));
      ASSERT_EQ(p.index(p.center(cell)), cell) << n << " rows";
    }
    EXPECT_EQ(p.index(Vec3f(0)), 0);
    EXPECT_EQ(p.index({0, 0, -1}), 4 * n * n);
    EXPECT_EQ(p.index({0, -1, 0}), 3 * n * n - 1);
  }
}

TEST(Partition, RefusesImpossibleRows) {
  EXPECT_THROW(Partition(0), ConfigError);
  EXPECT_THROW(Partition(-3), ConfigError);
  EXPECT_THROW(Partition(1025), ConfigError);
  EXPECT_NO_THROW(Partition(1024));
}

}  // namespace
}  // namespace photosphere::sphere
