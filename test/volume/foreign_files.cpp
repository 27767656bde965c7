// Files written by other software, with the counts that their writers recorded in them.
#include <gtest/gtest.h>

#include <openvdb/openvdb.h>

#include "photosphere/core/error.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::volume {
namespace {

// Grids carry `file_voxel_count` and `file_bbox_*` as their writer counted them.
void expectAsRecorded(const Grid& grid) {
  const auto metadata = grid.metadata();
  if (const auto it = metadata.find("file_voxel_count"); it != metadata.end())
    EXPECT_EQ(std::to_string(grid.activeVoxels()), it->second) << grid.name();
  if (const auto it = metadata.find("file_bbox_min"); it != metadata.end() && grid.activeVoxels()) {
    const Vec3i lo = grid.activeBounds().min;
    EXPECT_EQ(openvdb::Vec3i(lo.x, lo.y, lo.z).str(), it->second) << grid.name();
  }
}

class ForeignVdb : public ::testing::TestWithParam<const char*> {};

TEST_P(ForeignVdb, HoldsWhatItsWriterCountedAndSurvivesRewriting) {
  FOREIGN_CACHE(path, GetParam());
  const VdbFile file = readVdb(path);
  ASSERT_FALSE(file.grids.empty());
  for (const Grid& grid : file.grids)
    expectAsRecorded(grid);
  const test::TemporaryFolder folder;
  writeVdb(folder / "again.vdb", file.grids);
  const VdbFile again = readVdb(folder / "again.vdb");
  ASSERT_EQ(again.grids.size(), file.grids.size());
  for (std::size_t i = 0; i < file.grids.size(); ++i) {
    EXPECT_EQ(again.grids[i].name(), file.grids[i].name());
    EXPECT_EQ(again.grids[i].valueType(), file.grids[i].valueType());
    EXPECT_EQ(again.grids[i].activeVoxels(), file.grids[i].activeVoxels());
    EXPECT_EQ(again.grids[i].worldFromIndex(), file.grids[i].worldFromIndex());
  }
  std::string reason;
  EXPECT_TRUE(probeVdb(path, reason)) << reason;
}

INSTANTIATE_TEST_SUITE_P(Caches, ForeignVdb,
                         ::testing::Values("vdb_arnold/smoke.vdb", "vdb_arnold/torus01.vdb",
                                           "vdb_gaffer/points.vdb", "vdb_gaffer/sphere.vdb",
                                           "vdb_oiio/sphere.vdb", "vdb_oiio/sphereCd.vdb",
                                           "blender/gas_vdb16/data/fluid_data_0001.vdb",
                                           "blender/gas_vdb16/data/fluid_data_0016.vdb",
                                           "blender/liq_vdb/data/fluid_data_0008.vdb",
                                           "blender/liq_vdb/particles/fluid_particles_0001.vdb",
                                           "blender/liq_vdb/particles/fluid_particles_0016.vdb"));

TEST(ForeignVdbFacts, OldHalfFloatSmoke) {
  FOREIGN_CACHE(path, "vdb_arnold/smoke.vdb");
  const VdbFile file = readVdb(path);
  const Grid& density = file.find("density");
  EXPECT_EQ(density.valueType(), "float (half)");
  EXPECT_EQ(density.kind(), GridKind::scalar);
  EXPECT_EQ(density.activeVoxels(), 1049275u);
  const GridStatistics s = statistics(density);
  EXPECT_EQ(s.nans + s.infinities + s.negatives, 0u);
  EXPECT_GT(s.max, 0);
}

TEST(ForeignVdbFacts, FixedPointPositionsStayInTheirVoxels) {
  FOREIGN_CACHE(path, "vdb_gaffer/points.vdb");
  const VdbFile file = readVdb(path);
  const Grid* grid = file.points();
  ASSERT_TRUE(grid);
  const ParticleSet points = gridToPoints(*grid);
  ASSERT_GT(points.size(), 0u);
  Box3d bounds = grid->worldBounds();
  for (const Vec3d& p : points.positions)
    EXPECT_TRUE(bounds.contains(p));
  // The set fills the box of its voxels but for less than one voxel a side.
  EXPECT_LT(maxComponent(bounds.extent() - points.bounds().extent()),
            2 * maxComponent(grid->voxelSize()));
}

TEST(ForeignVdbFacts, BlenderLiquidParticlesHaveVelocity) {
  FOREIGN_CACHE(path, "blender/liq_vdb/particles/fluid_particles_0016.vdb");
  const ParticleSet points = gridToPoints(*readVdb(path).points());
  ASSERT_GT(points.size(), 1000u);
  bool velocity = false;
  for (const Attribute& attribute : points.attributes) {
    EXPECT_EQ(attribute.size(), points.size()) << attribute.name;
    velocity = velocity || attribute.arity == 3;
  }
  EXPECT_TRUE(velocity);
}

TEST(VdbFileNames, MissingAndDuplicateGridsListWhatThereIs) {
  const test::TemporaryFolder folder;
  const std::vector<float> ones(8, 1.0f);
  const Grid grid = denseToGrid("density", Vec3i(2), ones, Mat4d(1));
  writeVdb(folder / "two.vdb",
           {grid, renamed(grid, "heat"), denseToGrid("density", Vec3i(2), ones, Mat4d(1))});
  const VdbFile file = readVdb(folder / "two.vdb");
  ASSERT_EQ(file.grids.size(), 3u);
  EXPECT_EQ(file.find("heat").activeVoxels(), 8u);
  try {
    file.find("smoke");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("\"heat\" (float)"), std::string::npos);
  }
  try {
    file.find("density");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("2 grids named"), std::string::npos);
  }
}

// Grids as Blender and others leave them: no voxels, a stored box that is inverted.
TEST(VdbFileOddities, EmptyGridsAndEveryValueTypeAreRead) {
  const test::TemporaryFolder folder;
  openvdb::initialize();
  const auto put = [](auto grid, const char* name) {
    grid->setName(name);
    grid->tree().setValueOn(openvdb::Coord(1, 2, 3),
                            typename std::decay_t<decltype(*grid)>::ValueType(1));
    return Grid(grid);
  };
  auto empty = openvdb::Int32Grid::create();
  empty->setName("obstacles");
  auto half = openvdb::FloatGrid::create();
  half->setSaveFloatAsHalf(true);
  writeVdb(folder / "all.vdb",
           {Grid(empty), put(half, "half"), put(openvdb::DoubleGrid::create(), "double"),
            put(openvdb::Int32Grid::create(), "int"), put(openvdb::Int64Grid::create(), "long"),
            put(openvdb::BoolGrid::create(), "bool"), put(openvdb::Vec3SGrid::create(), "vec"),
            put(openvdb::Vec3DGrid::create(), "vecd"), put(openvdb::Vec3IGrid::create(), "veci"),
            put(openvdb::MaskGrid::create(), "mask")});
  const VdbFile file = readVdb(folder / "all.vdb");
  ASSERT_EQ(file.grids.size(), 10u);
  EXPECT_TRUE(file.find("obstacles").activeBounds().empty());
  EXPECT_TRUE(file.find("obstacles").worldBounds().empty());
  EXPECT_EQ(statistics(file.find("obstacles")).max, 0);
  EXPECT_EQ(file.find("half").valueType(), "float (half)");
  EXPECT_EQ(file.find("mask").kind(), GridKind::other);
  for (const char* name : {"half", "double", "int", "long", "bool"}) {
    EXPECT_EQ(file.find(name).kind(), GridKind::scalar) << name;
    EXPECT_EQ(statistics(file.find(name)).mean, 1) << name;
  }
  for (const char* name : {"vec", "vecd", "veci"}) {
    EXPECT_EQ(file.find(name).kind(), GridKind::vector) << name;
    EXPECT_DOUBLE_EQ(statistics(file.find(name)).max, std::sqrt(3.0)) << name;
  }
}

}  // namespace
}  // namespace photosphere::volume
