// photosphere plan from outside, and what render says of its plan.

#include <nlohmann/json.hpp>

#include "fixture.h"

namespace photosphere::test {
namespace {

using nlohmann::json;

class Plan : public ::testing::Test {
 protected:
  void SetUp() override {
    writeSmokeFrames(m_folder, 2);
    writeText(m_folder / "scene.toml", R"([camera]
position = [0.6, 0.5, 5]
look_at = [0.6, 0.5, 0.5]
resolution = [16, 12]
[[volume]]
file = "smoke.####.vdb"
density_scale = 4
[[light]]
type = "point"
name = "key"
position = [3, 3, 2]
intensity = 50
[[light]]
type = "spot"
name = "astray"
position = [3, 3, 2]
target = [9, 3, 2]
[estimator]
photons = 2000
[render]
samples = 1
)");
  }
  RunResult run(std::vector<std::string> arguments) { return runTool(arguments, m_folder.path()); }

  TemporaryFolder m_folder;
};

TEST_F(Plan, SaysEffectsBoundsSecondsAndMemory) {
  const RunResult plan = run({"plan", "scene.toml", "--frames", "1"});
  ASSERT_EQ(plan.exitCode, 0) << plan.err;
  for (const char* word : {"emission", "single_scattering", "multiple_scattering", "shadows",
                           "chromatic", "motion_blur", "depth_of_field", "environment", "lights",
                           "directions", "volumes", "bound", "no light of 'astray' reaches it",
                           "predicted seconds", "trace", "march", "predicted memory"})
    EXPECT_NE(plan.out.find(word), std::string::npos) << word << '\n' << plan.out;
  EXPECT_EQ(namesIn(m_folder.path()),
            (std::set<std::string>{"scene.toml", "smoke.0001.vdb", "smoke.0002.vdb"}));
}

TEST_F(Plan, WritesAJsonObjectAFrame) {
  const RunResult one = run({"plan", "scene.toml", "--frames", "2", "--json"});
  ASSERT_EQ(one.exitCode, 0) << one.err;
  const json object = json::parse(one.out);
  EXPECT_EQ(object.at("frame"), 2);
  EXPECT_TRUE(object.at("effects").at("multiple_scattering").at("on"));
  EXPECT_EQ(object.at("effects").at("lights").at("bound"), 0.0);
  EXPECT_GT(object.at("seconds").at("total"), 0.0);
  EXPECT_GT(object.at("memory_bytes").at("light"), 0);
  EXPECT_LT(object.at("memory_bytes").at("total"), object.at("memory_bytes").at("budget"));
  const RunResult both = run({"plan", "scene.toml", "--json"});
  ASSERT_EQ(both.exitCode, 0) << both.err;
  EXPECT_EQ(json::parse(both.out).size(), 2u);
}

TEST_F(Plan, TakesACacheWithoutAScene) {
  const RunResult plan = run({"plan", "smoke.0001.vdb", "--res", "16x9"});
  ASSERT_EQ(plan.exitCode, 0) << plan.err;
  EXPECT_NE(plan.out.find("16 x 9 pixels"), std::string::npos) << plan.out;
}

TEST_F(Plan, IsWhatRenderFollowsAndTells) {
  const std::vector<std::string> thin{"-s", "volume.0.density_scale=1e-5", "--frames", "1"};
  std::vector<std::string> planning{"plan", "scene.toml", "--json"};
  std::vector<std::string> rendering{"render", "scene.toml", "-o", "a.exr", "--stats", "s.json"};
  for (auto* arguments : {&planning, &rendering})
    arguments->insert(arguments->end(), thin.begin(), thin.end());
  const RunResult plan = run(planning), render = run(rendering);
  ASSERT_EQ(plan.exitCode, 0) << plan.err;
  ASSERT_EQ(render.exitCode, 0) << render.err;
  EXPECT_EQ(json::parse(plan.out).at("effects"),
            json::parse(readText(m_folder / "s.json")).at("effects"));
  EXPECT_NE(render.err.find("plan: single_scattering, "), std::string::npos) << render.err;
  EXPECT_NE(render.err.find("off: emission (no volume emits)"), std::string::npos) << render.err;
  const auto header = image::readExr(m_folder / "a.exr").attributes;
  EXPECT_NE(std::get<std::string>(header.at("photosphere:effects"))
                .find("multiple_scattering (the smoke is thin"),
            std::string::npos);
}

TEST_F(Plan, EndsAsRenderDoes) {
  EXPECT_EQ(run({"plan", "none.toml"}).exitCode, 3);
  EXPECT_EQ(run({"plan", "scene.toml", "-s", "camera.fof=3"}).exitCode, 2);
  EXPECT_EQ(run({"plan", "scene.toml", "--frames", "9"}).exitCode, 3);
  EXPECT_EQ(run({"plan", "scene.toml", "--frames", "1", "-s", "volume.0.density=smog"}).exitCode,
            4);
  EXPECT_EQ(run({"plan", "scene.toml", "--frames", "1", "-s", "render.memory_limit=1e-7"}).exitCode,
            5);
  EXPECT_EQ(run({"plan", "scene.toml", "--stats", "s.json"}).exitCode, 2);
}

}  // namespace
}  // namespace photosphere::test
