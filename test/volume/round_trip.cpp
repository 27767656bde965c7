// What goes into a .vdb comes out of it: points with every attribute type, dense grids, metadata.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "photosphere/core/error.h"
#include "photosphere/core/rng.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::volume {
namespace {

Mat4d scaleMatrix(double s) {
  Mat4d m(s);
  m[3][3] = 1;
  return m;
}

// Particles in a unit cube at `origin`, with every kind of attribute, each value a function of
// `id`.
ParticleSet sampleParticles(std::size_t count, const Vec3d& origin) {
  Rng rng(RandomKey::fromSeed(7, 0), RandomStream::test, 0);
  ParticleSet set;
  std::vector<std::int64_t> id;
  std::vector<float> scalar, velocity, pair, histogram;
  std::vector<double> exact, exactVector;
  std::vector<std::int32_t> number, cell;
  std::vector<std::string> label;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = rng.uniformDouble(), y = rng.uniformDouble(), z = rng.uniformDouble();
    set.positions.push_back(origin + Vec3d(x, y, z));
    const auto n = static_cast<double>(i);
    id.push_back(static_cast<std::int64_t>(i) + (std::int64_t(1) << 40));
    scalar.push_back(static_cast<float>(n) * 0.1f);
    exact.push_back(n / 3);
    number.push_back(-static_cast<std::int32_t>(i));
    label.push_back(i % 3 ? "smoke " + std::to_string(i % 5) : "");
    for (int c = 0; c < 3; ++c) {
      velocity.push_back(static_cast<float>(n) + 0.25f * static_cast<float>(c));
      exactVector.push_back(n / 7 + c);
      cell.push_back(static_cast<std::int32_t>(3 * i) + c);
    }
    for (int c = 0; c < 2; ++c)
      pair.push_back(static_cast<float>(n) * static_cast<float>(c));
    for (int c = 0; c < 96; ++c)
      histogram.push_back(static_cast<float>(n) + static_cast<float>(c));
  }
  set.add({"id", 1, id});
  set.add({"density", 1, scalar});
  set.add({"age", 1, exact});
  set.add({"number", 1, number});
  set.add({"v", 3, velocity});
  set.add({"spin", 3, exactVector});
  set.add({"cell", 3, cell});
  set.add({"uv", 2, pair});
  set.add({"photon_histogram", 96, histogram});
  set.add({"label", 1, label});
  set.metadata = {{"layout", "equal-area 32"}, {"photons", "1000000"}};
  return set;
}

// The place of each particle in the other set, by `id`.
std::vector<std::size_t> orderById(const ParticleSet& set) {
  const auto& id = std::get<std::vector<std::int64_t>>(set.find("id")->data);
  std::vector<std::size_t> order(id.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return id[a] < id[b]; });
  return order;
}

void expectSameParticles(const ParticleSet& before, const ParticleSet& after, double tolerance) {
  ASSERT_EQ(before.size(), after.size());
  const std::vector<std::size_t> order = orderById(after);
  double farthest = 0;
  for (std::size_t i = 0; i < order.size(); ++i)
    farthest =
        std::max(farthest, maxComponent(glm::abs(before.positions[i] - after.positions[order[i]])));
  EXPECT_LE(farthest, tolerance);
  ASSERT_EQ(before.attributes.size(), after.attributes.size());
  for (const Attribute& attribute : before.attributes) {
    const Attribute* other = after.find(attribute.name);
    ASSERT_TRUE(other) << attribute.name;
    ASSERT_EQ(attribute.arity, other->arity) << attribute.name;
    ASSERT_EQ(attribute.data.index(), other->data.index()) << attribute.name;
    std::visit(
        [&](const auto& column) {
          const auto& read = std::get<std::decay_t<decltype(column)>>(other->data);
          ASSERT_EQ(column.size(), read.size()) << attribute.name;
          const auto arity = static_cast<std::size_t>(attribute.arity);
          for (std::size_t i = 0; i < order.size(); ++i)
            for (std::size_t c = 0; c < arity; ++c)
              ASSERT_EQ(column[i * arity + c], read[order[i] * arity + c]) << attribute.name;
        },
        attribute.data);
  }
}

TEST(PointsRoundTrip, KeepsEveryAttributeTypeThroughAFile) {
  const test::TemporaryFolder folder;
  const ParticleSet before = sampleParticles(3000, Vec3d(-0.5));
  const Grid grid = pointsToGrid(before, "light", 0.1);
  EXPECT_EQ(grid.kind(), GridKind::points);
  writeVdb(folder / "p.vdb", {grid}, {{"scene", "abc"}});
  const VdbFile file = readVdb(folder / "p.vdb");
  EXPECT_EQ(file.metadata.at("scene"), "abc");
  ASSERT_TRUE(file.points());
  EXPECT_EQ(file.points()->name(), "light");
  const ParticleSet after = gridToPoints(*file.points());
  expectSameParticles(before, after, 0.1 * 0x1p-24);
  EXPECT_EQ(after.metadata, before.metadata);
}

TEST(PointsRoundTrip, IsAsExactAMillionUnitsFromTheOrigin) {
  const ParticleSet before = sampleParticles(500, Vec3d(1e6, -1e6, 2e6));
  const ParticleSet after = gridToPoints(pointsToGrid(before, "p", 0.1));
  // A double near 2e6 resolves 2.3e-10; two roundings of it and one float in the voxel.
  expectSameParticles(before, after, 1e-8);
}

TEST(PointsRoundTrip, MovesTheOriginWhenIndicesWouldOverflow) {
  const ParticleSet before = sampleParticles(500, Vec3d(1e6, 0, 0));
  const ParticleSet after = gridToPoints(pointsToGrid(before, "p", 1e-4));
  expectSameParticles(before, after, 1e-9);
}

TEST(PointsRoundTrip, ChoosesAboutEightPointsAVoxel) {
  for (const std::size_t count : {1000u, 100000u}) {
    const Grid grid = pointsToGrid(sampleParticles(count, Vec3d(3)), "p", 0);
    const double each = static_cast<double>(count) / static_cast<double>(grid.activeVoxels());
    EXPECT_GT(each, 4);
    EXPECT_LT(each, 12);
  }
}

TEST(PointsRoundTrip, OneParticleAndNone) {
  const ParticleSet one = sampleParticles(1, Vec3d(12345));
  expectSameParticles(one, gridToPoints(pointsToGrid(one, "p", 0)), 1e-7);
  EXPECT_EQ(gridToPoints(pointsToGrid(ParticleSet(), "p", 0)).size(), 0u);
}

TEST(PointsRoundTrip, OrderIsTheSameEachTime) {
  const ParticleSet before = sampleParticles(2000, Vec3d(0));
  const ParticleSet a = gridToPoints(pointsToGrid(before, "p", 0.05));
  const ParticleSet b = gridToPoints(pointsToGrid(before, "p", 0.05));
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(std::get<std::vector<std::int64_t>>(a.find("id")->data),
            std::get<std::vector<std::int64_t>>(b.find("id")->data));
  // Once in leaf order, a set keeps its order.
  const ParticleSet c = gridToPoints(pointsToGrid(a, "p", 0.05));
  EXPECT_EQ(std::get<std::vector<std::int64_t>>(a.find("id")->data),
            std::get<std::vector<std::int64_t>>(c.find("id")->data));
}

TEST(PointsRoundTrip, LeavesOutPositionsThatAreNotFinite) {
  ParticleSet set = sampleParticles(10, Vec3d(0));
  set.positions[3].y = std::nan("");
  set.positions[5].x = HUGE_VAL;
  EXPECT_EQ(gridToPoints(pointsToGrid(set, "p", 0)).size(), 8u);
}

// Garbage that is finite in the file, and farther than floats reach, is as none: voxels that hold
// it too would be so large that all else is at one place.
TEST(PointsRoundTrip, LeavesOutPositionsPastWhatFloatsHold) {
  for (const double far : {4e38, 1e60, 1e300}) {
    ParticleSet set;
    for (int i = 0; i < 100; ++i)
      set.positions.emplace_back(i, 2 * i, -i);
    set.positions.emplace_back(far, 0, 0);
    set.positions.emplace_back(0, -far, 0);
    const ParticleSet back = gridToPoints(pointsToGrid(set, "points", 0));
    ASSERT_EQ(back.size(), 100u) << far;
    double sum = 0;
    for (const Vec3d& p : back.positions)
      sum += p.x;
    EXPECT_NEAR(sum, 99 * 50, 1e-2) << far;
  }
}

TEST(PointsRoundTrip, RefusesAColumnOfTheWrongLength) {
  ParticleSet set = sampleParticles(10, Vec3d(0));
  set.add({"short", 1, std::vector<float>(9)});
  EXPECT_THROW(pointsToGrid(set, "p", 0), ConfigError);
}

TEST(DenseRoundTrip, ScalarAndVectorValuesComeBackInPlace) {
  const test::TemporaryFolder folder;
  const Vec3i dim(9, 17, 5), origin(-3, 4, -20);
  std::vector<float> scalar, vector;
  for (int i = 0; i < dim.x * dim.y * dim.z; ++i) {
    scalar.push_back(i % 4 ? static_cast<float>(i) : 0.0f);
    for (int c = 0; c < 3; ++c)
      vector.push_back(static_cast<float>(i % 7 * (c + 1)));
  }
  Mat4d matrix = scaleMatrix(0.25);
  matrix[3] = glm::dvec4(10, 20, 30, 1);
  writeVdb(folder / "d.vdb", {denseToGrid("density", dim, scalar, matrix, origin),
                              denseVectorToGrid("vel", dim, vector, matrix, origin)});
  const VdbFile file = readVdb(folder / "d.vdb");
  const Grid& density = file.find("density");
  EXPECT_EQ(density.worldFromIndex(), matrix);
  EXPECT_EQ(density.activeVoxels(),
            static_cast<std::uint64_t>(
                std::count_if(scalar.begin(), scalar.end(), [](float v) { return v != 0; })));
  EXPECT_EQ(density.activeBounds().min, origin);
  EXPECT_EQ(density.activeBounds().max, origin + dim - 1);
  const Vec3d lo = transformPoint(matrix, Vec3d(origin) - 0.5);
  EXPECT_EQ(density.worldBounds().min, lo);
  const GridStatistics statistic = statistics(density);
  EXPECT_EQ(statistic.max, *std::max_element(scalar.begin(), scalar.end()));
  const double sum = std::accumulate(scalar.begin(), scalar.end(), 0.0);
  EXPECT_NEAR(statistic.mean, sum / static_cast<double>(density.activeVoxels()), 1e-9);
  EXPECT_EQ(file.find("vel").kind(), GridKind::vector);
  EXPECT_FLOAT_EQ(static_cast<float>(statistics(file.find("vel")).max), 6 * std::sqrt(14.0f));
}

TEST(DenseRoundTrip, RefusesTheWrongNumberOfValues) {
  EXPECT_THROW(denseToGrid("d", Vec3i(2), std::vector<float>(7), Mat4d(1)), ConfigError);
  EXPECT_THROW(denseToGrid("d", Vec3i(1 << 30), std::vector<float>(7), Mat4d(1)), ConfigError);
  EXPECT_THROW(denseToGrid("d", Vec3i(-2), std::vector<float>(8), Mat4d(1)), ConfigError);
  EXPECT_THROW(denseToGrid("d", Vec3i(2), std::vector<float>(8), Mat4d(0)), ConfigError);
}

// Equal points pack into a 255th of what they are, which must not look like a file that lies.
TEST(PointsRoundTrip, ThoseThatPackIntoNextToNothing) {
  if (test::kSanitized) GTEST_SKIP() << "memory has no bound under a sanitizer";
  constexpr std::size_t count = 6'000'000;
  const test::TemporaryFolder folder;
  const auto path = folder / "equal.vdb";
  {
    ParticleSet set;
    set.positions.assign(count, Vec3d(0.0));
    set.add({"v", 3, std::vector<float>(3 * count, 1.0f)});
    writeVdb(path, {pointsToGrid(set, "points", 1)});
  }
  ASSERT_LT(std::filesystem::file_size(path), count / 4);
  const VdbFile file = readVdb(path);
  ASSERT_NE(file.points(), nullptr);
  EXPECT_EQ(gridToPoints(*file.points()).size(), count);
}

}  // namespace
}  // namespace photosphere::volume
