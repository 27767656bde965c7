#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "photosphere/caches/inspect.h"
#include "photosphere/core/error.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::caches {
namespace {

using test::TemporaryFolder;
using volume::Grid;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Mat4d uniform(double edge, const Vec3d& corner = Vec3d(0)) {
  Mat4d m(edge);
  m[3] = glm::dvec4(corner, 1);
  return m;
}

/// Density 0.5 in a block of 10 x 20 x 40 voxels of edge 0.1.
Grid block(const std::string& name = "density", double edge = 0.1) {
  return volume::denseToGrid(name, Vec3i(10, 20, 40), std::vector<float>(8000, 0.5f),
                             uniform(edge));
}

bool mentions(const std::vector<std::string>& lines, const std::string& words) {
  for (const std::string& line : lines)
    if (line.find(words) != std::string::npos) return true;
  return false;
}

class Inspect : public testing::Test {
 protected:
  InspectReport inspect(const std::vector<Grid>& grids, const std::string& name = "a.vdb") {
    volume::writeVdb(m_folder / name, grids);
    return inspectCache(m_folder / name);
  }
  TemporaryFolder m_folder;
};

TEST_F(Inspect, MeasuresOpticalDepthOfABlock) {
  const InspectReport report = inspect({block()});
  ASSERT_EQ(report.grids.size(), 1u);
  const GridReport& grid = report.grids[0];
  EXPECT_EQ(grid.activeVoxels, 8000u);
  EXPECT_EQ(grid.indexBounds.max, Vec3i(9, 19, 39));
  EXPECT_EQ(grid.transform, "uniform");
  ASSERT_TRUE(grid.opticalDepth.has_value());
  // Rays: 800 along x of depth 0.5, 400 along y of depth 1, 200 along z of depth 2.
  EXPECT_NEAR(grid.opticalDepth->p5, 0.5, 1e-6);
  EXPECT_NEAR(grid.opticalDepth->median, 0.5, 1e-6);
  EXPECT_NEAR(grid.opticalDepth->p95, 2.0, 1e-6);
  EXPECT_NEAR(grid.opticalDepth->meanFreePathVoxels, 2 / 0.1, 1e-4);
  EXPECT_DOUBLE_EQ(grid.opticalDepth->suggestedScale, 10);
  EXPECT_TRUE(report.sound()) << formatText(report);
}

TEST_F(Inspect, AveragesColumnsOfAHugeBox) {
  // Two voxels that span a box of 100,000 columns a side.
  const InspectReport report = inspect({volume::denseToGrid("density", Vec3i(2, 1, 1), {3.0f, 3.0f},
                                                            uniform(1), Vec3i(100000, 100000, 7))});
  ASSERT_TRUE(report.grids[0].opticalDepth.has_value());
  EXPECT_NEAR(report.grids[0].opticalDepth->p95, 6, 1e-9);
  EXPECT_NEAR(report.grids[0].opticalDepth->p5, 3, 1e-9);
}

TEST_F(Inspect, FindsWhatIsWrongWithGrids) {
  std::vector<float> values(8000, 0.5f);
  values[11] = kNan;
  values[30] = -2;
  values[31] = std::numeric_limits<float>::infinity();
  const Grid bad = volume::denseToGrid("density", Vec3i(10, 20, 40), values, uniform(0.1));
  Mat4d flat = uniform(0.1);
  flat[2][2] = 0.2;
  const Grid scaled = volume::denseToGrid("flat", Vec3i(1), {1}, flat);
  const Grid empty = volume::denseToGrid("nothing", Vec3i(1), {0}, uniform(0.1));
  const InspectReport report = inspect({bad, bad, scaled, empty});
  const GridReport& grid = report.grids.at(0);
  EXPECT_EQ(grid.nans, 1u);
  EXPECT_EQ(grid.infinities, 1u);
  EXPECT_EQ(grid.negatives, 1u);
  EXPECT_EQ(grid.firstInvalid, Vec3i(1, 1, 0));
  EXPECT_TRUE(mentions(report.warnings, "1 NaN"));
  EXPECT_TRUE(mentions(report.warnings, "negative density"));
  EXPECT_TRUE(mentions(report.warnings, "2 grids are named 'density'"));
  EXPECT_TRUE(mentions(report.warnings, "no cubes"));
  EXPECT_TRUE(mentions(report.warnings, "'nothing' is empty"));
  const auto json = nlohmann::json::parse(formatJson(report));
  EXPECT_EQ(json["grids"][0]["nan"], 1);
  EXPECT_TRUE(json["grids"][3]["index_box"].is_null());
}

TEST_F(Inspect, MeasuresVelocityInVoxelsAFrame) {
  const Grid velocity =
      volume::denseVectorToGrid("v", Vec3i(2, 1, 1), {3, 4, 0, 0, 0, 1}, uniform(0.1));
  const InspectReport report = inspect({velocity});
  ASSERT_TRUE(report.grids.at(0).velocityVoxelsPerFrame.has_value());
  EXPECT_NEAR(*report.grids[0].velocityVoxelsPerFrame, 5.0 / 24 / 0.1, 1e-5);
}

TEST_F(Inspect, GuessesUnits) {
  EXPECT_NE(inspect({block()}).unitsGuess.find("metres"), std::string::npos);
  EXPECT_NE(inspect({block("density", 100)}).unitsGuess.find("centimetres"), std::string::npos);
}

TEST_F(Inspect, MeasuresParticles) {
  test::writeText(m_folder / "a.csv",
                  "x,y,z,pscale,age\n0,0,0,0.1,1\n1,0,0,0,2\n2,0,0,0.2,nan\nnan,0,0,0.3,3\n");
  const InspectReport report = inspectCache(m_folder / "a.csv");
  const ParticleReport& set = report.particles.at(0);
  EXPECT_EQ(set.count, 4u);
  EXPECT_EQ(set.invalidPositions, 1u);
  EXPECT_EQ(set.bounds.max.x, 2);
  EXPECT_EQ(set.attributes.at(1).nans, 1u);
  EXPECT_EQ(set.attributes[1].mean, 2);
  EXPECT_TRUE(mentions(report.warnings, "positions are not finite"));
  EXPECT_TRUE(mentions(report.warnings, "'pscale' goes down to 0"));
  EXPECT_NE(formatText(report).find("pscale"), std::string::npos);
}

TEST_F(Inspect, MeasuresSpacing) {
  std::string text = "x,y,z\n";
  for (int i = 0; i < 200; ++i)
    text += std::to_string(i * 0.25) + ",0,0\n";
  test::writeText(m_folder / "a.csv", text);
  EXPECT_NEAR(inspectCache(m_folder / "a.csv").particles.at(0).medianSpacing, 0.25, 1e-9);
}

TEST_F(Inspect, ReportsDamagedAndForeignFiles) {
  inspect({block()});
  std::string bytes = test::readText(m_folder / "a.vdb");
  test::writeText(m_folder / "a.vdb", bytes.substr(0, bytes.size() / 2));
  const InspectReport cut = inspectCache(m_folder / "a.vdb");
  EXPECT_FALSE(cut.sound());
  EXPECT_NE(cut.error.find("a.vdb"), std::string::npos) << cut.error;
  EXPECT_EQ(nlohmann::json::parse(formatJson(cut))["error"], cut.error);
  test::writeText(m_folder / "a.abc", "Ogawa");
  EXPECT_NE(inspectCache(m_folder / "a.abc").error.find("Alembic"), std::string::npos);
  EXPECT_THROW(inspectCache(m_folder / "none.vdb"), InputMissingError);
}

TEST_F(Inspect, JsonHoldsNoNanAndAnyName) {
  test::writeText(
      m_folder / "a.ply",
      "ply\nformat ascii 1.0\ncomment \xFF\xFE\nelement vertex 1\nproperty float x\nproperty "
      "float y\nproperty float z\nproperty float \xE4\nend_header\nnan nan nan inf\n");
  const std::string json = formatJson(inspectCache(m_folder / "a.ply"));
  EXPECT_TRUE(nlohmann::json::accept(json)) << json;
}

TEST_F(Inspect, FollowsASequence) {
  inspect({block()}, "s.0001.vdb");
  inspect({block("density", 0.2), block("heat")}, "s.0002.vdb");
  inspect({block("heat")}, "s.0004.vdb");
  const SequenceReport report = inspectSequence((m_folder / "s.####.vdb").string());
  EXPECT_EQ(report.frames, (std::vector<std::int64_t>{1, 2, 4}));
  EXPECT_EQ(report.holes, (std::vector<std::int64_t>{3}));
  EXPECT_TRUE(mentions(report.warnings, "'density' is missing in frames 4"));
  EXPECT_TRUE(mentions(report.warnings, "'heat' is missing in frames 1"));
  EXPECT_TRUE(mentions(report.warnings, "'density' changes its voxel size"));
  EXPECT_FALSE(mentions(report.warnings, "'heat' changes"));
  EXPECT_EQ(nlohmann::json::parse(formatJson(report))["holes"][0], 3);
  EXPECT_THROW(inspectSequence((m_folder / "t.####.vdb").string()), InputMissingError);
}

TEST(InspectFiles, SimulationsOfBlender) {
  FOREIGN_CACHE(path, "blender/gas_vdb16/data/fluid_data_0016.vdb");
  const InspectReport report = inspectCache(path);
  EXPECT_TRUE(report.error.empty()) << report.error;
  EXPECT_TRUE(mentions(report.warnings, "staggered"));
  EXPECT_TRUE(mentions(report.warnings, "domain"));
  EXPECT_NE(report.unitsGuess.find("Blender"), std::string::npos);
}

/// 60,000 particles that follow the smoke of the simulation beside it.
TEST(InspectFiles, ShippedParticles) {
  std::filesystem::path path = test::projectFile("data/caches/column_pts_0042.ply");
  if (!std::filesystem::exists(path)) path = test::foreignCache("../sims/column_pts_0042.ply");
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no simulation at " << path;
  const InspectReport report = inspectCache(path);
  ASSERT_EQ(report.particles.size(), 1u) << report.error;
  const ParticleReport& set = report.particles[0];
  EXPECT_EQ(set.count, 60000u);
  EXPECT_EQ(set.invalidPositions, 0u);
  EXPECT_NEAR(set.bounds.max.z, 2.999, 1e-3);
  EXPECT_EQ(set.attributes.size(), 8u);
  EXPECT_TRUE(report.sound()) << formatText(report);
}

}  // namespace
}  // namespace photosphere::caches
