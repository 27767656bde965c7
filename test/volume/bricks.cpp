// The render-time sampler and the majorants against slow oracles.

#include "photosphere/volume/bricks.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Interpolation.h>

#include "openvdb_instances.h"
#include "photosphere/core/error.h"
#include "photosphere/core/rng.h"
#include "photosphere/volume/majorant_grid.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using volume::BrickField;

// A grid with leaves, a tile, a gap and values at negative indices.
openvdb::FloatGrid::Ptr patchyGrid() {
  openvdb::initialize();
  auto grid = openvdb::FloatGrid::create(0.0f);
  grid->setName("density");
  auto accessor = grid->getAccessor();
  Rng rng(RandomKey::fromSeed(1, 0), RandomStream::test, 0);
  for (int i = 0; i < 400; ++i)
    accessor.setValue(
        {static_cast<int>(rng.bits() % 30) - 17, static_cast<int>(rng.bits() % 30) - 5,
         static_cast<int>(rng.bits() % 30) - 40},
        rng.uniform());
  grid->fill(openvdb::CoordBBox({16, 16, 16}, {47, 31, 31}), 0.75f);
  return grid;
}

TEST(Bricks, SampleAsOpenVdbInterpolates) {
  const auto grid = patchyGrid();
  const auto bricks = volume::bricksFromGrid(volume::Grid(grid), 0, "test", false, 0);
  Rng rng(RandomKey::fromSeed(2, 0), RandomStream::test, 0);
  const openvdb::FloatGrid::ConstAccessor accessor = grid->getConstAccessor();
  int smoky = 0;
  for (int i = 0; i < 50000; ++i) {
    const Vec3f p(rng.uniform() * 80 - 25, rng.uniform() * 50 - 10, rng.uniform() * 90 - 48);
    const float expected = openvdb::tools::BoxSampler::sample(
        accessor, openvdb::Vec3d(static_cast<double>(p.x), static_cast<double>(p.y),
                                 static_cast<double>(p.z)));
    ASSERT_NEAR(bricks.sample(p - Vec3f(bricks.origin())), expected, 1e-5)
        << p.x << ' ' << p.y << ' ' << p.z;
    smoky += expected > 0;
  }
  EXPECT_GT(smoky, 1000);
}

TEST(Bricks, OutsideAndNanAreZero) {
  const auto bricks = volume::bricksFromGrid(volume::Grid(patchyGrid()), 0, "test", false, 0);
  EXPECT_EQ(bricks.sample(Vec3f(-1, 5, 5)), 0.0f);
  EXPECT_EQ(bricks.sample(Vec3f(1e30f, 5, 5)), 0.0f);
  EXPECT_EQ(bricks.sample(Vec3f(NAN, 5, 5)), 0.0f);
}

TEST(Bricks, TilesStayTiles) {
  openvdb::initialize();
  auto grid = openvdb::FloatGrid::create(0.0f);
  grid->fill(openvdb::CoordBBox({0, 0, 0}, {511, 511, 511}), 1.0f);
  const auto bricks = volume::bricksFromGrid(volume::Grid(grid), 0, "test", false, 0);
  EXPECT_LT(bricks.memoryBytes(), 100u << 20);  // densified it would be 512 MiB
  EXPECT_EQ(bricks.sample(Vec3f(500.3f)), 1.0f);
}

TEST(Bricks, RefuseWhatCannotBeExtinction) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), kInfinity, -1.0f}) {
    auto grid = patchyGrid();
    grid->getAccessor().setValue({3, 4, 5}, bad);
    try {
      volume::bricksFromGrid(volume::Grid(grid), 0, "a.vdb", false, 0);
      ADD_FAILURE() << bad << " was taken";
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("(3, 4, 5)"), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find("density"), std::string::npos);
    }
  }
}

TEST(Majorants, AreNeverExceededUnderAnyTransform) {
  const auto bricks = volume::bricksFromGrid(volume::Grid(patchyGrid()), 0, "test", false, 0);
  Mat4d rotated(1.0);
  rotated[0] = glm::dvec4(0.8, 0.6, 0, 0);
  rotated[1] = glm::dvec4(-0.3, 0.4, 0.1, 0);
  rotated[2] = glm::dvec4(0, 0.2, -1.7, 0);
  rotated[3] = glm::dvec4(5, -3, 2, 1);
  for (const Mat4d& placement : {Mat4d(1.0), rotated}) {
    const volume::MajorantSource source{&bricks, placement, 3.0};
    const volume::MajorantGrid majorants(std::span(&source, 1));
    const Mat4d inverse = glm::inverse(placement);
    Rng rng(RandomKey::fromSeed(3, 0), RandomStream::test, 0);
    for (int i = 0; i < 100000; ++i) {
      const Vec3d p = majorants.bounds().min +
                      majorants.bounds().extent() *
                          Vec3d(rng.uniformDouble(), rng.uniformDouble(), rng.uniformDouble());
      const float sigma = 3 * bricks.sample(Vec3f(transformPoint(inverse, p)));
      const Vec3i cell = glm::min(Vec3i((p - majorants.bounds().min) / Vec3d(majorants.cellSize())),
                                  majorants.dims() - 1);
      ASSERT_LE(sigma, majorants.majorant(cell) * 1.001f + 1e-6f);
    }
  }
}

// A small volume of fine voxels in the corner of a coarse one: steps are fine where it is.
TEST(Majorants, CoarsenessIsThatOfTheFinestVoxelsInACell) {
  const auto bricks = volume::bricksFromGrid(volume::Grid(patchyGrid()), 0, "test", false, 0);
  const volume::MajorantSource coarse{&bricks, Mat4d(1.0), 1.0};
  Mat4d small(0.11);
  small[3][3] = 1;
  const volume::MajorantSource fine{&bricks, small, 1.0};
  const volume::MajorantGrid alone(std::span(&coarse, 1));
  for (std::size_t cell = 0; cell < alone.size(); ++cell)
    ASSERT_EQ(alone.coarseness(cell), 1.0f);
  const volume::MajorantSource both[] = {coarse, fine};
  const volume::MajorantGrid majorants(both);
  const Box3d near = volume::supportBounds(bricks, small);
  int fines = 0, coarses = 0;
  for (std::size_t cell = 0; cell < majorants.size(); ++cell) {
    const Vec3i at(static_cast<int>(cell) % majorants.dims().x,
                   static_cast<int>(cell) / majorants.dims().x % majorants.dims().y,
                   static_cast<int>(cell) / (majorants.dims().x * majorants.dims().y));
    if (!(majorants.majorant(at) > 0.0f)) continue;
    const float coarseness = majorants.coarseness(cell);
    ASSERT_TRUE(coarseness == 1.0f || coarseness == 8.0f) << coarseness;  // 9 times as wide
    (coarseness == 1.0f ? fines : coarses) += 1;
    const Vec3d low = majorants.bounds().min + Vec3d(at) * Vec3d(majorants.cellSize());
    if (glm::any(glm::greaterThan(low, near.max + 0.01))) {
      ASSERT_EQ(coarseness, 8.0f) << cell;
    }
  }
  EXPECT_GT(fines, 0);
  EXPECT_GT(coarses, fines);
}

TEST(Majorants, WalkVisitsTheCellsOfARayInOrder) {
  const auto bricks = volume::bricksFromGrid(volume::Grid(patchyGrid()), 0, "test", false, 0);
  const volume::MajorantSource source{&bricks, Mat4d(1.0), 1.0};
  const volume::MajorantGrid majorants(std::span(&source, 1));
  Rng rng(RandomKey::fromSeed(4, 0), RandomStream::test, 0);
  const Vec3f low(majorants.bounds().min), extent(majorants.bounds().extent());
  for (int i = 0; i < 2000; ++i) {
    const Vec3f o = low + extent * Vec3f(rng.uniform(), rng.uniform(), rng.uniform());
    Vec3f d = glm::normalize(Vec3f(rng.uniform(), rng.uniform(), rng.uniform()) - 0.5f);
    if (i % 7 == 0) d = Vec3f(0, i % 2 ? 1 : -1, 0);  // exactly along an axis
    float last = 0.0f;
    for (volume::MajorantGrid::Walk walk(majorants, o, d, 0.0f, kInfinity); !walk.done();
         walk.advance()) {
      ASSERT_LE(last, walk.begin() + 1e-4f);
      if (walk.end() - walk.begin() > 1e-3f && walk.end() < kInfinity) {
        const Vec3f middle = o + d * (0.5f * (walk.begin() + walk.end()));
        const Vec3i cell = glm::clamp(Vec3i((middle - low) / majorants.cellSize()), Vec3i(0),
                                      majorants.dims() - 1);
        ASSERT_EQ(walk.majorant(), majorants.majorant(cell));
      }
      last = walk.begin();
    }
  }
}

}  // namespace

}  // namespace photosphere::test
