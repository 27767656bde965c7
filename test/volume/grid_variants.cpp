// Tiles in larger voxels: the same box of the world, and few of them.

#include "photosphere/volume/grid_variants.h"

#include <gtest/gtest.h>

#include "photosphere/core/types.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using volume::Grid;

Mat4d placement() {
  Mat4d m(1.0);
  m[0] = glm::dvec4(0.01, 0, 0, 0);
  m[1] = glm::dvec4(0.002, 0.01, 0, 0);
  m[2] = glm::dvec4(0, 0, 0.02, 0);
  m[3] = glm::dvec4(3, -1, 2, 1);
  return m;
}

// What the voxels of a grid fill, in the world: its first and last corner.
void expectSameBox(const Grid& grid, const Grid& larger, double begin) {
  const Box3i fine = grid.activeBounds(), coarse = larger.activeBounds();
  const auto corner = [&](const Grid& g, const Vec3i& voxel, double at) {
    return transformPoint(g.worldFromIndex(), Vec3d(voxel) + at);
  };
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(corner(grid, fine.min, begin)[axis], corner(larger, coarse.min, begin)[axis], 1e-9);
    EXPECT_NEAR(corner(grid, fine.max, begin + 1)[axis],
                corner(larger, coarse.max, begin + 1)[axis], 1e-9);
  }
}

TEST(TilesInLargerVoxels, FillTheSameBox) {
  const Box3i box{Vec3i(-4096, 0, 4096), Vec3i(-1, 4095, 8191)};
  const Grid grid = volume::constantGrid("density", box, 0.5f, placement());
  for (const bool cellCentered : {false, true}) {
    const Grid larger = volume::tilesInLargerVoxels(grid, cellCentered);
    EXPECT_EQ(larger.activeBounds().max - larger.activeBounds().min + 1, Vec3i(64));
    EXPECT_EQ(larger.name(), "density");
    expectSameBox(grid, larger, cellCentered ? 0.0 : -0.5);
  }
}

// No larger than the smallest tile: here 8 voxels, of a box of 520.
TEST(TilesInLargerVoxels, AreNoLargerThanATile) {
  const Box3i box{Vec3i(-8), Vec3i(511)};
  const Grid larger =
      volume::tilesInLargerVoxels(volume::constantGrid("density", box, 0.5f, placement()), false);
  EXPECT_EQ(larger.activeBounds().max - larger.activeBounds().min + 1, Vec3i(65));
  EXPECT_EQ(larger.activeBounds().min, Vec3i(-1));
}

// Boxes that few voxels span, or whose faces are leaves, are left alone.
TEST(TilesInLargerVoxels, StayWhereVoxelsAreNeeded) {
  for (const Box3i& box : {Box3i{Vec3i(0), Vec3i(63)}, Box3i{Vec3i(0), Vec3i(1020)}}) {
    const Grid grid = volume::constantGrid("density", box, 0.5f, placement());
    EXPECT_EQ(volume::tilesInLargerVoxels(grid, false).activeBounds().max, box.max);
  }
}

}  // namespace

}  // namespace photosphere::test
