// Files written by other software, with the counts that their writers recorded in them.
#include <gtest/gtest.h>

#include <cmath>

#include "openvdb_instances.h"
#include "photosphere/core/error.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::volume {
namespace {

// Grids carry `file_voxel_count` and `file_bbox_*` as their writer counted them.
void expectAsRecorded(const Grid& grid) {
  const auto metadata = grid.metadata();
  if (const auto it = metadata.find("file_voxel_count"); it != metadata.end()) {
    EXPECT_EQ(std::to_string(grid.activeVoxels()), it->second) << grid.name();
  }
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
  // By type name: each grid type that a test names costs seconds of compiling.
  std::vector<Grid> grids;
  for (const char* type : {"int32", "double", "int64", "bool", "vec3s", "vec3d", "vec3i", "mask",
                           "ptdataidx32", "ptidx32"}) {
    const auto grid = openvdb::GridBase::createGrid(std::string("Tree_") + type + "_5_4_3");
    grid->setName(type);
    grids.emplace_back(grid);
  }
  auto half = openvdb::FloatGrid::create();
  half->setSaveFloatAsHalf(true);
  half->setName("half");
  half->tree().setValueOn(openvdb::Coord(1, 2, 3), 1.0f);
  grids.emplace_back(half);
  writeVdb(folder / "all.vdb", grids);
  const VdbFile file = readVdb(folder / "all.vdb");
  ASSERT_EQ(file.grids.size(), grids.size());
  for (const Grid& grid : file.grids) {
    EXPECT_EQ(grid.activeBounds().empty(), grid.name() != "half") << grid.name();
    EXPECT_EQ(grid.worldBounds().empty(), grid.name() != "half") << grid.name();
  }
  EXPECT_EQ(file.find("half").valueType(), "float (half)");
  EXPECT_EQ(statistics(file.find("half")).mean, 1);
  EXPECT_EQ(file.find("mask").kind(), GridKind::other);
  EXPECT_EQ(file.find("ptidx32").kind(), GridKind::other);
  EXPECT_EQ(file.find("ptdataidx32").kind(), GridKind::points);
  EXPECT_EQ(gridToPoints(file.find("ptdataidx32")).size(), 0u);
  for (const char* name : {"double", "int32", "int64", "bool"}) {
    EXPECT_EQ(file.find(name).kind(), GridKind::scalar) << name;
    EXPECT_EQ(statistics(file.find(name)).max, 0) << name;
  }
  for (const char* name : {"vec3s", "vec3d", "vec3i"}) {
    EXPECT_EQ(file.find(name).kind(), GridKind::vector) << name;
    EXPECT_EQ(statistics(file.find(name)).max, 0) << name;
  }
  EXPECT_THROW(statistics(file.find("mask")), InputError);
}

TEST(VdbFileOddities, ActiveTilesCountEachOfTheirVoxels) {
  auto grid = openvdb::FloatGrid::create();
  grid->fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(1023)), 2.0f);
  grid->tree().setValueOn(openvdb::Coord(-1, 0, 0), -1.0f);
  const GridStatistics s = statistics(Grid(grid));
  const double tiles = 0x1p30;
  EXPECT_DOUBLE_EQ(s.mean, (2 * tiles - 1) / (tiles + 1));
  EXPECT_EQ(s.negatives, 1u);
  EXPECT_LT(Grid(grid).memoryBytes(), 100'000'000u);
  grid->fill(openvdb::CoordBBox(openvdb::Coord(8), openvdb::Coord(15)), std::nanf(""));
  EXPECT_EQ(statistics(Grid(grid)).nans, 512u);
  EXPECT_EQ(statistics(Grid(grid)).firstInvalid, Vec3i(8));
}

TEST(GridEdits, TransformRenameAndScaleLeaveTheOriginalAlone) {
  Mat4d matrix(0.5);
  matrix[3][3] = 1;
  const Grid before = denseVectorToGrid("vel", Vec3i(1), {1, 2, 2}, matrix);
  Mat4d move(1);
  move[3] = glm::dvec4(10, 0, 0, 1);
  const Grid after = scaled(renamed(transformed(before, move), "v"), -2);
  EXPECT_EQ(after.name(), "v");
  EXPECT_EQ(after.worldFromIndex(), move * matrix);
  EXPECT_EQ(statistics(after).max, 6);
  EXPECT_EQ(before.name(), "vel");
  EXPECT_EQ(before.worldFromIndex(), matrix);
  EXPECT_EQ(statistics(before).max, 3);
  EXPECT_THROW(transformed(before, Mat4d(0)), ConfigError);
  EXPECT_THROW(scaled(denseToGrid("d", Vec3i(1), {1.0f}, matrix), 2), InputError);
}

}  // namespace
}  // namespace photosphere::volume
