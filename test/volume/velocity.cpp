// Velocities made ready for lookups, from grids and from particles.

#include <gtest/gtest.h>

#include "openvdb_instances.h"
#include "photosphere/core/error.h"
#include "photosphere/volume/bricks.h"
#include "photosphere/volume/vdb_file.h"
#include "photosphere/volume/velocity.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

using namespace volume;

constexpr int kEdge = 6;

// A velocity that is linear in the index, so that means of neighbours are known.
Grid linearGrid(bool staggered) {
  std::vector<float> values;
  for (int z = 0; z < kEdge; ++z)
    for (int y = 0; y < kEdge; ++y)
      for (int x = 0; x < kEdge; ++x)
        for (const float v : {1.0f + static_cast<float>(x), 2.0f, -1.0f - static_cast<float>(z)})
          values.push_back(v);
  const Grid grid = denseVectorToGrid("v", Vec3i(kEdge), values, Mat4d(1.0), Vec3i(0));
  if (staggered) grid.base()->setGridClass(openvdb::GRID_STAGGERED);
  return grid;
}

Vec3f at(const BrickField<Vec4f>& field, const Vec3d& index) {
  return Vec3f(field.sample(Vec3f(index - Vec3d(field.origin()))));
}

TEST(Velocity, IsTurnedAndScaledIntoPlace) {
  Mat3d quarter(0.0);  // x to y, y to -x, z doubled
  quarter[0] = {0, 1, 0};
  quarter[1] = {-1, 0, 0};
  quarter[2] = {0, 0, 2};
  const auto field =
      vectorBricksFromGrid(velocityForLookups(linearGrid(false), quarter, 0, "a.vdb"), "a.vdb", 0);
  const Vec3f v = at(field, {2, 3, 4});
  EXPECT_FLOAT_EQ(v.x, -2.0f);
  EXPECT_FLOAT_EQ(v.y, 3.0f);
  EXPECT_FLOAT_EQ(v.z, -10.0f);
}

// A component of a staggered grid lies on the voxel's lower face: half a voxel before its centre.
TEST(Velocity, StaggeredComponentsAreBroughtToTheCentres) {
  const auto field = vectorBricksFromGrid(
      velocityForLookups(linearGrid(true), Mat3d(1.0), 0, "a.vdb"), "a.vdb", 0);
  const Vec3f v = at(field, {2, 3, 3});
  EXPECT_FLOAT_EQ(v.x, 3.5f);
  EXPECT_FLOAT_EQ(v.y, 2.0f);
  EXPECT_FLOAT_EQ(v.z, -4.5f);
  // The last face has no next one.
  EXPECT_FLOAT_EQ(at(field, {kEdge - 1, 3, 3}).x, static_cast<float>(kEdge));
}

TEST(Velocity, GoesOnBeyondItsVoxels) {
  const Grid grid = linearGrid(false);
  const auto bare =
      vectorBricksFromGrid(velocityForLookups(grid, Mat3d(1.0), 0, "a.vdb"), "a.vdb", 0);
  const auto wide =
      vectorBricksFromGrid(velocityForLookups(grid, Mat3d(1.0), 4, "a.vdb"), "a.vdb", 0);
  EXPECT_EQ(at(bare, {2, 2, -3}), Vec3f(0.0f));
  for (int i = 1; i <= 4; ++i) {
    const Vec3f v = at(wide, {2, 2, -i});
    EXPECT_NEAR(v.x, 3.0f, i < 3 ? 1e-5f : 0.1f) << "the mean of neighbours";
    EXPECT_NEAR(v.y, 2.0f, 1e-5f);
    EXPECT_NEAR(v.z, -1.0f, 1e-5f);
  }
  EXPECT_EQ(at(wide, {2, 2, -6}), Vec3f(0.0f));
  // What was there stays as it was.
  for (int i = 0; i < kEdge; ++i)
    EXPECT_EQ(at(wide, {i, 3, i}), at(bare, {i, 3, i}));
}

TEST(Velocity, RefusesWhatIsNone) {
  const Grid density = denseToGrid("density", Vec3i(2), std::vector<float>(8, 1.0f), Mat4d(1.0));
  EXPECT_THROW(velocityForLookups(density, Mat3d(1.0), 1, "a.vdb"), InputError);
  std::vector<float> values(3 * 8, 1.0f);
  values[4] = std::numeric_limits<float>::quiet_NaN();
  const Grid broken = denseVectorToGrid("v", Vec3i(2), values, Mat4d(1.0), Vec3i(0));
  try {
    velocityForLookups(broken, Mat3d(1.0), 1, "a.vdb");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("not finite at voxel (1, 0, 0)"), std::string::npos)
        << error.what();
  }
}

// Two clouds that fly apart keep their own velocity; where both are, the mean by mass is.
TEST(Velocity, OfParticlesIsTheirMeanByMass) {
  ParticleSet set;
  std::vector<double> mass;
  std::vector<float> v;
  const auto add = [&](const Vec3d& p, double m, const Vec3f& velocity) {
    set.positions.push_back(p);
    mass.push_back(m);
    for (int c = 0; c < 3; ++c)
      v.push_back(velocity[c]);
  };
  add({0, 0, 0}, 1.0, {3, -1, 0});
  add({10, 0, 0}, 1.0, {-5, 0, 2});
  add({20, 0, 0}, 1.0, {1, 0, 0});
  add({20, 0, 0}, 3.0, {-1, 4, 0});
  set.add({"mass", 1, mass});
  set.add({"v", 3, v});
  RasterizeOptions options;
  options.radius = 2.0;
  options.voxelSize = 0.5;
  const Grid grid = velocityOfParticles(set, "v", options, "a.ply");
  const Grid density = rasterize(set, options).density;
  EXPECT_EQ(grid.activeVoxels(), density.activeVoxels());
  const auto field = vectorBricksFromGrid(grid, "a.ply", 0);
  const Mat4d indexFromWorld = glm::inverse(grid.worldFromIndex());
  const auto near = [&](const Vec3d& p) { return at(field, transformPoint(indexFromWorld, p)); };
  EXPECT_LT(glm::length(near({0.4, 0.2, 0}) - Vec3f(3, -1, 0)), 1e-4f);
  EXPECT_LT(glm::length(near({10.3, 0.1, 0.2}) - Vec3f(-5, 0, 2)), 1e-4f);
  EXPECT_LT(glm::length(near({20, 0, 0}) - Vec3f(-0.5, 3, 0)), 1e-4f);
  EXPECT_THROW(velocityOfParticles(set, "w", options, "a.ply"), InputError);
  EXPECT_THROW(velocityOfParticles(set, "mass", options, "a.ply"), InputError);
}

// Neither does one drag the others along, nor does it stand still where it is alone.
TEST(Velocity, OfParticlesThatSayNoneIsThatOfTheOthers) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  ParticleSet set;
  set.positions = {{0, 0, 0}, {0, 0, 0}, {20, 0, 0}};
  set.add({"v", 3, std::vector<float>{3, -1, 0, 5, nan, 0, nan, nan, nan}});
  RasterizeOptions options;
  options.radius = 2.0;
  options.voxelSize = 0.5;
  const InvalidVelocities found = findInvalidVelocities(set, "v");
  EXPECT_EQ(found.count, 2u);
  EXPECT_EQ(found.first, 1u);
  EXPECT_EQ(findInvalidVelocities(set, "w").count, 0u);
  const Grid grid = velocityOfParticles(set, "v", options, "a.ply");
  EXPECT_LT(grid.worldBounds().max.x, 3.0);
  const GridStatistics lengths = statistics(grid);
  EXPECT_NEAR(lengths.min, std::sqrt(10.0), 1e-4);
  EXPECT_NEAR(lengths.max, std::sqrt(10.0), 1e-4);
  set.add({"v", 3, std::vector<double>{1e39, 0, 0, 0, -1e39, 0, 0, 0, 1e300}});
  EXPECT_EQ(findInvalidVelocities(set, "v").count, 3u);
  EXPECT_FALSE(velocityOfParticles(set, "v", options, "a.ply"));
}

}  // namespace
}  // namespace photosphere::test
