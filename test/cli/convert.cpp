// photosphere convert: mass, attributes, placement, sequences, whole outputs.

#include <cmath>

#include "fixture.h"
#include "photosphere/caches/cache_format.h"
#include "photosphere/volume/grid_variants.h"

namespace photosphere::test {
namespace {

using volume::ParticleSet;

/// A cache of the project; while it is not there, from the folder of caches beside it.
fs::path shippedCache(const std::string& name) {
  const fs::path own = projectFile("data/caches/" + name);
  return fs::exists(own) ? own : foreignCache("../sims/" + name);
}

#define SHIPPED_CACHE(variable, name)           \
  const fs::path variable = shippedCache(name); \
  if (!fs::exists(variable)) GTEST_SKIP() << "no cache at " << variable.string()

double massDifference(const std::string& report) {
  const std::string key = "relative difference ";
  const std::size_t at = report.find(key);
  return at == std::string::npos ? 1.0 : std::stod(report.substr(at + key.size()));
}

/// Order of a set by a whole-number attribute: point grids sort particles by voxel.
std::vector<std::size_t> orderById(const ParticleSet& set) {
  std::vector<std::size_t> order(set.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    order[i] = i;
  const volume::Attribute& id = *set.find("id");
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return id.number(a) < id.number(b); });
  return order;
}

void expectSameParticles(const ParticleSet& wanted, const ParticleSet& got, double tolerance) {
  ASSERT_EQ(got.size(), wanted.size());
  ASSERT_NE(got.find("id"), nullptr);
  const auto a = orderById(wanted), b = orderById(got);
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_LT(glm::length(wanted.positions[a[i]] - got.positions[b[i]]), tolerance);
  for (const volume::Attribute& attribute : wanted.attributes) {
    const volume::Attribute* other = got.find(attribute.name);
    ASSERT_NE(other, nullptr) << attribute.name;
    ASSERT_EQ(other->arity, attribute.arity) << attribute.name;
    for (std::size_t i = 0; i < a.size(); ++i)
      for (int c = 0; c < attribute.arity; ++c)
        EXPECT_NEAR(other->number(b[i], c), attribute.number(a[i], c), tolerance) << attribute.name;
  }
}

class Convert : public ::testing::Test {
 protected:
  RunResult convert(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "convert");
    return runTool(arguments, m_folder.path());
  }
  volume::VdbFile read(const std::string& name) { return volume::readVdb(m_folder / name); }

  TemporaryFolder m_folder;
};

TEST_F(Convert, KeepsAttributesAndMassOfParticles) {
  const ParticleSet set = ribbon(2000, true);
  writePly(m_folder / "points.ply", set);
  const RunResult result = convert({"points.ply", "-o", "points.vdb"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_LE(massDifference(result.out), 1e-5) << result.out;
  const volume::VdbFile file = read("points.vdb");
  EXPECT_NEAR(massOf(file.find("density")) / massOf(set), 1, 1e-5);
  expectSameParticles(set, volume::gridToPoints(file.find("points")), 1e-5);
  EXPECT_NE(result.out.find("pscale, 0.05 to 0.15"), std::string::npos) << result.out;
}

TEST_F(Convert, ChoosesARadiusFromSpacingAndSaysSo) {
  const ParticleSet set = ribbon(2000, false);
  writePly(m_folder / "points.ply", set);
  const RunResult result = convert({"points.ply", "-o", "points.vdb"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_NE(result.out.find("twice the median spacing"), std::string::npos) << result.out;
  const ParticleSet got = volume::gridToPoints(read("points.vdb").find("points"));
  ASSERT_NE(got.find("pscale"), nullptr);
  EXPECT_GT(got.find("pscale")->number(0), 0);
  EXPECT_NEAR(massOf(read("points.vdb").find("density")) / massOf(set), 1, 1e-5);
}

TEST_F(Convert, UsesTheRadiusAndVoxelSizeThatAreAsked) {
  writePly(m_folder / "points.ply", ribbon(300, true));
  const RunResult result =
      convert({"points.ply", "-o", "x.vdb", "--radius", "0.3", "--voxel-size", "0.125"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(result.out.find("pscale, "), std::string::npos) << result.out;
  EXPECT_NEAR(read("x.vdb").find("density").voxelSize().x, 0.125, 1e-12);
}

TEST_F(Convert, KeepsTheDensityGridBesideParticles) {
  const volume::Grid ball = ballOfSmoke(0.1);
  volume::writeVdb(m_folder / "both.vdb",
                   {ball, volume::pointsToGrid(ribbon(200, true), "dust", 0)});
  const RunResult result = convert({"both.vdb", "-o", "out.vdb"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const volume::VdbFile file = read("out.vdb");
  EXPECT_EQ(file.grids.size(), 2u);
  EXPECT_DOUBLE_EQ(massOf(file.find("density")), massOf(ball));
  EXPECT_EQ(volume::gridToPoints(file.find("points")).size(), 200u);
}

TEST_F(Convert, SeedsParticlesInProportionToDensity) {
  const volume::Grid ball = ballOfSmoke(0.1);
  volume::writeVdb(m_folder / "ball.vdb", {ball});
  for (const char* name : {"a.vdb", "b.vdb"})
    ASSERT_EQ(convert({"ball.vdb", "-o", name, "--particles", "5000", "--seed", "9"}).exitCode, 0);
  ASSERT_EQ(convert({"ball.vdb", "-o", "c.vdb", "--particles", "5000", "--seed", "8"}).exitCode, 0);
  const ParticleSet a = volume::gridToPoints(read("a.vdb").find("points"));
  const ParticleSet b = volume::gridToPoints(read("b.vdb").find("points"));
  const ParticleSet c = volume::gridToPoints(read("c.vdb").find("points"));
  ASSERT_EQ(a.size(), 5000u);
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_NE(a.positions, c.positions);
  EXPECT_NEAR(massOf(a) / massOf(ball), 1, 1e-5);
  ASSERT_EQ(convert({"ball.vdb", "-o", "none.vdb", "--particles", "0"}).exitCode, 0);
  EXPECT_EQ(read("none.vdb").points(), nullptr);
}

TEST_F(Convert, PlacesGridsThatLackTheirPlace) {
  constexpr double h = 0.25;
  Mat4d worldFromIndex(h);
  worldFromIndex[3][3] = 1;
  const volume::Grid velocity =
      volume::denseVectorToGrid("velocity", Vec3i(2, 1, 1), {1, 2, 3, 4, 5, 6}, worldFromIndex);
  const volume::Grid ball = ballOfSmoke(h);
  const volume::Grid color = volume::denseVectorToGrid("Cd", Vec3i(1), {3, 0, 4}, worldFromIndex);
  volume::writeVdb(m_folder / "raw.vdb", {ball, velocity, color});
  const RunResult result =
      convert({"raw.vdb", "-o", "out.vdb", "--origin", "-2,-2,0.5", "--cell-centered",
               "--velocity-scale", "2", "--particles", "100"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const volume::VdbFile file = read("out.vdb");
  const Vec3d moved = file.find("density").worldBounds().min - ball.worldBounds().min;
  EXPECT_NEAR(glm::length(moved - Vec3d(-2 + h / 2, -2 + h / 2, 0.5 + h / 2)), 0, 1e-12);
  EXPECT_NEAR(volume::statistics(file.find("velocity")).max, 2 * std::sqrt(16.0 + 25 + 36), 1e-5);
  EXPECT_NEAR(volume::statistics(file.find("Cd")).max, 5, 1e-6);  // a colour is not a velocity
  const Box3d bounds = file.find("density").worldBounds();
  for (const Vec3d& p : volume::gridToPoints(file.find("points")).positions)
    EXPECT_TRUE(bounds.contains(p)) << p.x << ' ' << p.y << ' ' << p.z;
}

TEST_F(Convert, MergesTheFilesOfAFrame) {
  volume::writeVdb(m_folder / "density.vdb", {ballOfSmoke(0.1)});
  volume::writeVdb(m_folder / "flame.vdb", {ballOfSmoke(0.1, "flame")});
  ParticleSet other = ribbon(10, false);
  other.add({"age", 1, std::vector<float>(10, 2.5f)});
  writePly(m_folder / "a.ply", ribbon(30, true));
  writePly(m_folder / "b.ply", other);
  const RunResult result = convert({"density.vdb", "flame.vdb", "a.ply", "b.ply", "-o", "out.vdb"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const volume::VdbFile file = read("out.vdb");
  EXPECT_NE(file.tryFind("density"), nullptr);
  EXPECT_NE(file.tryFind("flame"), nullptr);
  const ParticleSet set = volume::gridToPoints(file.find("points"));
  ASSERT_EQ(set.size(), 40u);
  for (const char* name : {"age", "pscale", "id"})
    ASSERT_NE(set.find(name), nullptr) << name;
  int withAge = 0, withRadius = 0;
  for (std::size_t i = 0; i < set.size(); ++i) {
    withAge += set.find("age")->number(i) == 2.5;
    withRadius += set.find("pscale")->number(i) > 0;
  }
  EXPECT_EQ(withAge, 10);
  EXPECT_EQ(withRadius, 30);
}

TEST_F(Convert, GoesRoundThroughEveryPointFormat) {
  const ParticleSet set = ribbon(500, true);
  writePly(m_folder / "0.ply", set);
  const std::vector<std::string> names{"0.ply", "1.vdb", "2.prt", "3.csv", "4.ply"};
  for (std::size_t i = 0; i + 1 < names.size(); ++i) {
    const RunResult result = convert({names[i], "-o", names[i + 1]});
    ASSERT_EQ(result.exitCode, 0) << names[i + 1] << result.err;
  }
  const caches::CacheContent last = caches::readCache(m_folder / "4.ply");
  ASSERT_EQ(last.particles.size(), 1u);
  expectSameParticles(set, last.particles.front(), 1e-5);
}

// A channel's name has 32 bytes with its end.
TEST_F(Convert, SaysWhichAttributesPrtNamesOtherwise) {
  const std::string name(40, 'a');
  writeText(m_folder / "in.csv", "x,y,z," + name + ",heat!\n0,0,0,1,2\n1,1,1,3,4\n");
  const RunResult result = convert({"in.csv", "-o", "out.prt"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  for (const std::string& text :
       {"attribute '" + name + "' is written as PRT channel '" + name.substr(0, 31) + "'",
        std::string("attribute 'heat!' is written as PRT channel 'heat_'")})
    EXPECT_NE(result.err.find(text), std::string::npos) << result.err;
}

TEST_F(Convert, SeedsNothingInAFrustum) {
  volume::writeVdb(m_folder / "in.vdb", {volume::inFrustum(ballOfSmoke(0.1))});
  const RunResult result = convert({"in.vdb", "-o", "out.vdb"});
  EXPECT_EQ(result.exitCode, 4);
  EXPECT_NE(result.err.find("in.vdb: grid 'density' has a frustum transform"), std::string::npos)
      << result.err;
  EXPECT_EQ(convert({"in.vdb", "-o", "out.vdb", "--particles", "0"}).exitCode, 0);
}

TEST_F(Convert, LeavesTheOldOutputWhenItFails) {
  volume::writeVdb(m_folder / "good.vdb", {ballOfSmoke(0.1)});
  volume::writeVdb(m_folder / "bad.vdb", {ballOfSmoke(0.2)});
  truncate(m_folder / "bad.vdb");
  ASSERT_EQ(convert({"good.vdb", "-o", "out.vdb"}).exitCode, 0);
  const std::string before = readText(m_folder / "out.vdb");
  EXPECT_EQ(convert({"bad.vdb", "-o", "out.vdb"}).exitCode, 4);
  EXPECT_EQ(readText(m_folder / "out.vdb"), before);
}

class ConvertSequence : public Convert {
 protected:
  void SetUp() override {
    for (int i = 1; i <= 3; ++i)
      volume::writeVdb(m_folder / ("in.000" + std::to_string(i) + ".vdb"), {ballOfSmoke(0.1 / i)});
  }
};

TEST_F(ConvertSequence, FindsItsFramesAndKeepsTheirVoxelSizes) {
  const RunResult result = convert({"in.####.vdb", "-o", "out/x.%03d.vdb", "--particles", "50"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(namesIn(m_folder / "out"),
            (std::set<std::string>{"x.001.vdb", "x.002.vdb", "x.003.vdb"}));
  for (int i = 1; i <= 3; ++i)
    EXPECT_NEAR(read("out/x.00" + std::to_string(i) + ".vdb").find("density").voxelSize().x,
                0.1 / i, 1e-12);
}

TEST_F(ConvertSequence, TellsOfFramesThatAreMissing) {
  const std::string hole = "warning: in.####.vdb: frames are missing: 2";
  const std::vector<std::string> all{"in.####.vdb", "-o", "x.####.vdb", "--particles", "50"};
  RunResult result = convert(all);
  EXPECT_EQ(result.err.find("missing"), std::string::npos) << result.err;
  fs::rename(m_folder / "in.0002.vdb", m_folder / "in.0004.vdb");
  result = convert(all);
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_NE(result.err.find(hole), std::string::npos) << result.err;
  std::vector<std::string> some = all;
  some.insert(some.end(), {"--frames", "1,3"});
  result = convert(some);
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(result.err.find("missing"), std::string::npos) << result.err;
}

TEST_F(ConvertSequence, DeliversTheOtherFramesWhenOneIsBad) {
  truncate(m_folder / "in.0002.vdb");
  RunResult result =
      convert({"in.####.vdb", "-o", "x.####.vdb", "--frames", "1-4", "--keep-going"});
  EXPECT_EQ(result.exitCode, 8) << result.err;
  EXPECT_TRUE(fs::exists(m_folder / "x.0001.vdb"));
  EXPECT_FALSE(fs::exists(m_folder / "x.0002.vdb"));
  EXPECT_TRUE(fs::exists(m_folder / "x.0003.vdb"));
  EXPECT_FALSE(fs::exists(m_folder / "x.0004.vdb"));
  EXPECT_NE(result.err.find("2 of 4 frames failed: 2,4"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("in.0002.vdb"), std::string::npos) << result.err;
  result = convert({"in.####.vdb", "-o", "y.####.vdb", "--frames", "1-4"});
  EXPECT_EQ(result.exitCode, 4) << result.err;
  EXPECT_FALSE(fs::exists(m_folder / "y.0003.vdb"));
}

TEST_F(ConvertSequence, SkipsOnlyOutputsThatAreComplete) {
  ASSERT_EQ(convert({"in.####.vdb", "-o", "x.####.vdb", "--particles", "50"}).exitCode, 0);
  truncate(m_folder / "x.0002.vdb");
  const auto first = fs::last_write_time(m_folder / "x.0001.vdb");
  const RunResult result =
      convert({"in.####.vdb", "-o", "x.####.vdb", "--particles", "50", "--skip-existing"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_EQ(fs::last_write_time(m_folder / "x.0001.vdb"), first);
  EXPECT_NO_THROW(read("x.0002.vdb"));
}

TEST_F(ConvertSequence, DryRunWritesNothing) {
  const auto before = namesIn(m_folder.path());
  const RunResult result = convert({"in.####.vdb", "-o", "x.####.vdb", "--dry-run"});
  EXPECT_EQ(result.exitCode, 0) << result.err;
  EXPECT_NE(result.out.find("x.0003.vdb"), std::string::npos) << result.out;
  EXPECT_EQ(namesIn(m_folder.path()), before);
}

TEST_F(Convert, ReadsTheShippedColumn) {
  SHIPPED_CACHE(points, "column_pts_0042.ply");
  SHIPPED_CACHE(grids, "column_0042.vdb");
  RunResult result = convert({points.string(), "-o", "points.vdb"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  EXPECT_LE(massDifference(result.out), 1e-5) << result.out;
  EXPECT_EQ(volume::gridToPoints(read("points.vdb").find("points")).size(), 60000u);
  result = convert({grids.string(), "-o", "grids.vdb", "--origin", "-2,-2,0", "--cell-centered"});
  ASSERT_EQ(result.exitCode, 0) << result.err;
  const volume::VdbFile file = read("grids.vdb");
  // The column's particles follow its smoke: their boxes must agree to a few voxels.
  const Box3d smoke = file.find("density").worldBounds();
  const Box3d dust = volume::gridToPoints(read("points.vdb").find("points")).bounds();
  EXPECT_LT(glm::length(smoke.center() - dust.center()), 0.3);
}

}  // namespace
}  // namespace photosphere::test
