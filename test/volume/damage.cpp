// What is said of a damaged file (test/fuzz damages each byte of one), and output whole or absent.
#include <gtest/gtest.h>
#include <openvdb/points/PointDataGrid.h>
#include <signal.h>
#include <sys/resource.h>

#include "photosphere/core/error.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::volume {
namespace {

namespace fs = std::filesystem;

// A density grid and three points: small enough to damage each byte in turn.
std::string smallFile(const test::TemporaryFolder& folder) {
  ParticleSet points;
  points.positions = {Vec3d(0.1), Vec3d(0.2, 0.3, 0.9), Vec3d(1.5)};
  points.add({"v", 3, std::vector<float>{1, 2, 3, 4, 5, 6, 7, 8, 9}});
  points.add({"label", 1, std::vector<std::string>{"a", "b", "a"}});
  std::vector<float> values(27);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<float>(i);
  writeVdb(folder / "small.vdb",
           {denseToGrid("density", Vec3i(3), values, Mat4d(1)), pointsToGrid(points, "points", 1)},
           {{"note", "made to be damaged"}});
  return test::readText(folder / "small.vdb");
}

TEST(DamagedVdb, TheMessageSaysWhereAndWhat) {
  const test::TemporaryFolder folder;
  const std::string whole = smallFile(folder);
  const auto message = [&](const std::string& content) -> std::string {
    test::writeText(folder / "x.vdb", content);
    try {
      readVdb(folder / "x.vdb");
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message("").find("0 bytes"), std::string::npos);
  EXPECT_NE(message("not a vdb at all").find("is not a .vdb file"), std::string::npos);
  EXPECT_NE(message(whole.substr(0, whole.size() - 1)).find("not copied whole"), std::string::npos);
  std::string newer = whole;
  newer[8] = static_cast<char>(0xff);
  EXPECT_NE(message(newer).find("at byte 8: file version 255"), std::string::npos);
  EXPECT_THROW(readVdb(folder / "none.vdb"), InputMissingError);
  EXPECT_THROW(readVdb(folder.path()), InputMissingError);
}

// A writer to a pipe cannot go back to note where its grids are, and says so in byte 20. Their
// lengths are walked all the same.
TEST(DamagedVdb, AFileWithoutOffsetsIsWalkedToItsEnd) {
  const test::TemporaryFolder folder;
  std::vector<float> values(27, 2.0f);
  const Grid density = denseToGrid("density", Vec3i(3), values, Mat4d(1));
  const Grid heat = denseToGrid("heat", Vec3i(3), values, Mat4d(1));
  writeVdb(folder / "whole.vdb", {density, heat});
  std::string streamed = test::readText(folder / "whole.vdb");
  ASSERT_EQ(streamed[20], 1);
  streamed[20] = 0;
  test::writeText(folder / "streamed.vdb", streamed);
  const VdbFile file = readVdb(folder / "streamed.vdb");
  ASSERT_EQ(file.grids.size(), 2u);
  EXPECT_EQ(file.find("heat").activeVoxels(), 27u);
  std::string reason;
  EXPECT_TRUE(probeVdb(folder / "streamed.vdb", reason)) << reason;
  for (std::size_t i = 0; i < streamed.size(); ++i) {
    test::writeText(folder / "cut.vdb", streamed.substr(0, i));
    EXPECT_THROW(readVdb(folder / "cut.vdb"), InputError) << i;
  }
}

TEST(DamagedVdb, ProbingSaysWhyAndLeavesThisProcessAlone) {
  const test::TemporaryFolder folder;
  const std::string whole = smallFile(folder);
  std::string reason = "old";
  EXPECT_TRUE(probeVdb(folder / "small.vdb", reason)) << reason;
  EXPECT_EQ(reason, "");
  test::writeText(folder / "cut.vdb", whole.substr(0, whole.size() / 2));
  EXPECT_FALSE(probeVdb(folder / "cut.vdb", reason));
  EXPECT_NE(reason.find("cut.vdb"), std::string::npos);
  EXPECT_FALSE(probeVdb(folder / "none.vdb", reason));
}

Grid bigGrid() {
  std::vector<float> noise(64 * 64 * 64);
  std::uint32_t state = 1;
  for (float& v : noise)
    v = static_cast<float>(state = state * 1664525u + 1013904223u);
  return denseToGrid("density", Vec3i(64), noise, Mat4d(1));
}

// A column of one value takes the same room in a file however many points it says that it is of.
TEST(DamagedVdb, PointsThatNoMemoryHoldsAreRefusedBeforeTheyAreRead) {
  namespace pts = openvdb::points;
  openvdb::initialize();
  auto grid = pts::PointDataGrid::create();
  const auto descriptor = pts::AttributeSet::Descriptor::create(
      pts::TypedAttributeArray<openvdb::Vec3f>::attributeType());
  constexpr openvdb::Index kEach = 4'000'000'000;
  for (int i = 0; i < 64; ++i) {  // 6 TB of positions
    auto* leaf = grid->tree().touchLeaf(openvdb::Coord(8 * i, 0, 0));
    leaf->initializeAttributes(descriptor, kEach);
    std::vector<openvdb::PointDataIndex32> ends(pts::PointDataTree::LeafNodeType::SIZE, kEach);
    leaf->setOffsets(ends);
  }
  try {
    gridToPoints(Grid(grid));
    FAIL() << "read";
  } catch (const MemoryError& error) {
    EXPECT_NE(std::string(error.what()).find("256000000000 points"), std::string::npos)
        << error.what();
  }
}

TEST(VdbOutput, AFullDeviceIsAnError) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  EXPECT_THROW(writeVdb("/dev/full", {bigGrid()}), OutputError);
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST(VdbOutput, AFileSizeLimitLeavesTheOldFileAndNoTemporary) {
  const test::TemporaryFolder folder;
  const fs::path path = folder / "out.vdb";
  writeVdb(path, {denseToGrid("density", Vec3i(1), {1.0f}, Mat4d(1))});
  const std::string before = test::readText(path);
  const Grid grid = bigGrid();
  struct rlimit old {};
  getrlimit(RLIMIT_FSIZE, &old);
  struct rlimit small = old;
  small.rlim_cur = 100'000;
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(writeVdb(path, {grid}), OutputError);
  setrlimit(RLIMIT_FSIZE, &old);
  signal(SIGXFSZ, handler);
  EXPECT_EQ(test::readText(path), before);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
  writeVdb(path, {grid});
  EXPECT_EQ(readVdb(path).find("density").activeVoxels(), 64u * 64 * 64);
}

TEST(VdbOutput, NothingToWriteIsAnError) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(writeVdb(folder / "a.vdb", {}), OutputError);
  EXPECT_THROW(writeVdb(folder / "a.vdb", {Grid()}), OutputError);
  EXPECT_FALSE(fs::exists(folder / "a.vdb"));
}

}  // namespace
}  // namespace photosphere::volume
