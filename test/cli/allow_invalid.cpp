// Caches with NaN, infinite and negative values: refused by name, or taken as zero where that is
// allowed.

#include <limits>

#include "fixture.h"

namespace photosphere::test {
namespace {

class Invalid : public ::testing::Test {
 protected:
  void SetUp() override {
    std::vector<float> values(12 * 12 * 12, 1.0f);
    values[700] = std::numeric_limits<float>::quiet_NaN();
    values[701] = std::numeric_limits<float>::infinity();
    values[702] = -2;
    volume::writeVdb(m_folder / "bad.vdb",
                     {volume::denseToGrid("density", Vec3i(12), values, Mat4d(1.0))});
    writeText(
        m_folder / "a.toml",
        "[camera]\nposition = [6, 6, 60]\nlook_at = [6, 6, 6]\nresolution = [8, 8]\n"
        "[[volume]]\nfile = \"bad.vdb\"\n[[light]]\ntype = \"point\"\nposition = [40, 20, 20]\n"
        "intensity = 1000\n[estimator]\nphotons = 1000\n");
  }
  RunResult run(std::vector<std::string> arguments, bool allow) {
    if (allow) arguments.emplace_back("--allow-invalid");
    return runTool(arguments, m_folder.path());
  }
  TemporaryFolder m_folder;
};

// 700 = (4 * 12 + 10) * 12 + 4.
constexpr const char* kCounts =
    "1 NaN, 1 infinite and 1 negative values, the first (nan) at voxel (4, 10, 4)";

TEST_F(Invalid, EveryCommandRefusesThemByName) {
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"render", "a.toml", "-o", "a.exr"},
        {"render", "bad.vdb", "-o", "a.exr"},
        {"trace", "a.toml", "-o", "light.vdb"},
        {"plan", "a.toml"},
        {"convert", "bad.vdb", "-o", "out.vdb"}}) {
    const RunResult result = run(command, false);
    EXPECT_EQ(result.exitCode, 4) << command[0] << result.err;
    EXPECT_NE(result.err.find("grid 'density'"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(kCounts), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("--allow-invalid"), std::string::npos) << result.err;
  }
  for (const char* name : {"a.exr", "light.vdb", "out.vdb"})
    EXPECT_FALSE(fs::exists(m_folder / name)) << name;
}

TEST_F(Invalid, AreZeroWhereAllowed) {
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"render", "a.toml", "-o", "a.exr"},
        {"render", "bad.vdb", "-o", "b.exr", "--res", "8x8", "-s", "estimator.photons=1000"},
        {"trace", "a.toml", "-o", "light.vdb"},
        {"plan", "a.toml"},
        {"convert", "bad.vdb", "-o", "out.vdb"}}) {
    const RunResult result = run(command, true);
    EXPECT_EQ(result.exitCode, 0) << command[0] << result.err;
    EXPECT_NE(result.err.find(kCounts), std::string::npos) << command[0] << result.err;
  }
  const volume::GridStatistics written =
      volume::statistics(volume::readVdb((m_folder / "out.vdb").string()).find("density"));
  EXPECT_EQ(written.nans + written.infinities + written.negatives, 0u);
  EXPECT_EQ(written.min, 0);
  EXPECT_EQ(run({"render", "out.vdb", "-o", "c.exr", "--res", "8x8"}, false).exitCode, 0);
}

TEST_F(Invalid, SoArePicturesOfTheSurroundings) {
  volume::writeVdb(m_folder / "good.vdb", {ballOfSmoke(0.1)});
  image::Image sky(8, 4);
  sky.addLayer("", image::ChannelKind::color);
  for (int i = 0; i < 32; ++i)
    sky.setRgb("", i % 8, i / 8, Rgb(0.5f));
  sky.setRgb("", 2, 1, Rgb(0.5f, 1234.5f, 0.5f));
  sky.setRgb("", 4, 3, Rgb(-0.5f));
  image::ExrOptions options;
  options.compression = image::ExrCompression::none;
  options.floatColor = true;
  image::writeExr(m_folder / "sky.exr", sky, {}, options);
  replaceFloats(m_folder / "sky.exr", 1234.5f, std::numeric_limits<float>::quiet_NaN());
  const std::vector<std::string> command = {
      "render", "good.vdb",
      "-o",     "s.exr",
      "--res",  "8x8",
      "-s",     "estimator.photons=1000",
      "-s",     "light=[{ type = \"environment\", file = \"sky.exr\" }]"};
  constexpr const char* kPixels =
      "1 NaN, 0 infinite and 1 negative pixels, the first (nan) at (2, 1)";
  const RunResult refused = run(command, false);
  EXPECT_EQ(refused.exitCode, 4) << refused.err;
  for (const char* words : {"sky.exr: ", kPixels, "--allow-invalid"})
    EXPECT_NE(refused.err.find(words), std::string::npos) << refused.err;
  EXPECT_FALSE(fs::exists(m_folder / "s.exr"));
  const RunResult taken = run(command, true);
  EXPECT_EQ(taken.exitCode, 0) << taken.err;
  EXPECT_NE(taken.err.find(kPixels), std::string::npos) << taken.err;
}

TEST_F(Invalid, NegativeValuesOfOtherGridsArePlain) {
  volume::writeVdb(
      m_folder / "shadow.vdb",
      {ballOfSmoke(0.1),
       volume::denseToGrid("shadow", Vec3i(2), std::vector<float>(8, -1.0f), Mat4d(1.0))});
  EXPECT_EQ(run({"convert", "shadow.vdb", "-o", "kept.vdb"}, false).exitCode, 0);
  EXPECT_EQ(
      volume::statistics(volume::readVdb((m_folder / "kept.vdb").string()).find("shadow")).max, -1);
}

TEST_F(Invalid, ParticlesAreRefusedOrLeftOut) {
  volume::ParticleSet set = ribbon(50, true);
  std::get<std::vector<float>>(set.find("pscale")->data)[7] =
      std::numeric_limits<float>::quiet_NaN();
  volume::writeVdb(m_folder / "points.vdb", {volume::pointsToGrid(set, "points", 0)});
  const RunResult refused = run({"render", "points.vdb", "-o", "p.exr", "--res", "8x8"}, false);
  EXPECT_EQ(refused.exitCode, 4) << refused.err;
  EXPECT_NE(refused.err.find("1 of 50 particles have a position, radius or mass"),
            std::string::npos)
      << refused.err;
  const RunResult taken = run({"render", "points.vdb", "-o", "p.exr", "--res", "8x8"}, true);
  EXPECT_EQ(taken.exitCode, 0) << taken.err;
  EXPECT_NE(taken.err.find("they are left out"), std::string::npos) << taken.err;
}

// Those that lie nowhere, and those that fly nowhere; the first of either is number 3.
TEST_F(Invalid, PositionsAndVelocitiesOfParticlesAreRefusedOrLeftOut) {
  std::string places = "x,y,z,pscale\n", flights = "x,y,z,pscale,vx,vy,vz\n";
  for (int i = 0; i < 6; ++i) {
    places += fmt::format("{},0,{},1\n", i, i == 3 ? "nan" : i == 4 ? "-inf" : "0");
    flights += fmt::format("{},0,0,1,{},0,0\n", i, i >= 3 ? "nan" : "1");
  }
  writeText(m_folder / "places.csv", places);
  writeText(m_folder / "flights.csv", flights);
  const std::vector<std::string> still{"render", "places.csv", "-o", "p.exr", "--res", "8x8"};
  const std::vector<std::string> moving{"render", "flights.csv",
                                        "-o",     "p.exr",
                                        "--res",  "8x8",
                                        "-s",     "volume.0.velocity=v",
                                        "-s",     "estimator.photons=1000",
                                        "-s",     "effects.motion_blur=on"};
  for (const auto& [command, what] :
       {std::pair{still,
                  "places.csv: 2 of 6 particles have a position that is not finite, the "
                  "first is number 3"},
        std::pair{moving,
                  "flights.csv: 3 of 6 particles have a velocity 'v' that is not finite, "
                  "the first is number "}}) {
    const RunResult refused = run(command, false);
    EXPECT_EQ(refused.exitCode, 4) << refused.err;
    EXPECT_NE(refused.err.find(what), std::string::npos) << refused.err;
    EXPECT_FALSE(fs::exists(m_folder / "p.exr"));
    const RunResult taken = run(command, true);
    EXPECT_EQ(taken.exitCode, 0) << taken.err;
    EXPECT_NE(taken.err.find(what), std::string::npos) << taken.err;
    fs::remove(m_folder / "p.exr");
  }
}

}  // namespace
}  // namespace photosphere::test
