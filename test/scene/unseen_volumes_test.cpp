// Volumes out of view: what bounds say that they do to the picture is never less than what they do,
// and the plan leaves out those alone whose bound fits.

#include "unseen_volumes.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "blur.h"
#include "fixture.h"
#include "photosphere/scene/plan.h"

namespace photosphere::test {
namespace {

using namespace scene;

// A ball of smoke about the origin of which the frame shows the middle, and another.
class Unseen : public ::testing::Test {
 protected:
  std::string volume(const Vec3d& at, const std::string& keys) const {
    const std::string path = (m_folder / fmt::format("at_{}_{}_{}.vdb", at.x, at.y, at.z)).string();
    volume::writeVdb(path, {ballGrid("density", at, 0.1), ballGrid("flame", at, 0.1)});
    return fmt::format("[[volume]]\nfile = \"{}\"\n{}\n", path, keys);
  }
  static std::string light(const std::string& type, const std::string& keys) {
    return fmt::format("[[light]]\ntype = \"{}\"\n{}\n", type, keys);
  }
  SceneFile scene(const std::string& more, std::vector<std::string> sets) const {
    sets.insert(sets.begin(), {"camera.fov=4", "camera.resolution=[8, 8]",
                               "render.shadow=\"march\"", "render.filter=\"box\""});
    return parseScene(ballScene(m_ball, Vec3d(0), 1, more), "test.toml", m_folder.path(), sets);
  }
  static double mean(const std::vector<Rgb>& pixels) {
    double sum = 0;
    for (const Rgb& p : pixels)
      sum += static_cast<double>(meanComponent(p)) / static_cast<double>(pixels.size());
    return sum;
  }
  std::string writeBall() const {
    const std::string path = (m_folder / "ball.vdb").string();
    volume::writeVdb(path, {ballGrid("density", Vec3d(0.0), 0.1)});
    return path;
  }

  TemporaryFolder m_folder;
  std::string m_ball = writeBall();
};

struct Row {
  const char* label;
  Vec3d at;
  const char* keys;   // of the volume
  const char* light;  // of the other lamp: its type
  const char* lightKeys;
  std::vector<std::string> sets;
  double loose;  // the bound is at most so many times what was measured
};

void PrintTo(const Row& row, std::ostream* out) {
  *out << row.label;
}

class UnseenBound : public Unseen, public ::testing::WithParamInterface<Row> {};

TEST_P(UnseenBound, IsNoLessThanWhatTheVolumeDoes) {
  const Row& row = GetParam();
  std::vector<std::string> sets{"estimator.type=\"path_traced\"", "effects.tolerance=0",
                                "effects.shadows=\"on\"",
                                fmt::format("estimator.samples={}", kSanitized ? 256 : 16384)};
  sets.insert(sets.end(), row.sets.begin(), row.sets.end());
  const std::string lamp = *row.light ? light(row.light, row.lightKeys) : "";
  const SceneFile both = scene(lamp + volume(row.at, row.keys), sets);

  const FrameSetup setup = setUpFrame(both, 1);
  ASSERT_EQ(setup.medium->volumes().size(), 2u);
  const UnseenVolumes volumes(both, setup, seenDirections(both, setup));
  ASSERT_EQ(volumes.unseen(), (std::vector<bool>{false, true}));
  const double bound =
      volumes.effects({false, true}, setup.lights, setup.effects.multipleScattering)[1];

  const double with = mean(renderScene(both, 1).layers.beauty);
  const double without = mean(renderScene(scene(lamp, sets), 1).layers.beauty);
  const double difference = std::abs(with - without);
  fmt::print("  {}: {:.3g} without it {:.3g}, bound {:.3g}\n", row.label, with, without, bound);
  EXPECT_LE(difference, bound);
  if (!kSanitized) {
    EXPECT_GT(difference, 0.0);
    EXPECT_LE(bound, row.loose * difference);
  }
}

// The main lamp is off, so that the picture is what the volume adds; or it is all scattered once.
const std::vector<std::string> kDark{"light.0.intensity=0", "volume.0.albedo=0.6"};
const std::vector<std::string> kSingle{"light.0.intensity=0", "estimator.type=\"single\"",
                                       "render.samples=64"};

const Row kRows[] = {
    {"LitBeside",
     {0, -2.6, 0},
     "density_scale = 3\nalbedo = 0.6",
     "spot",
     "position = [0, -2.6, 5]\ntarget = [0, -2.6, 0]\nintensity = 100\ncone_angle = 8",
     kDark,
     20000},
    {"LitFar",
     {0, -12, 0},
     "density_scale = 3\nalbedo = 0.6",
     "spot",
     "position = [0, -12, 5]\ntarget = [0, -12, 0]\nintensity = 100\ncone_angle = 8",
     kDark,
     2000},
    {"LitThin",
     {0, -4, 0},
     "density_scale = 0.02\nalbedo = 0.6",
     "spot",
     "position = [0, -4, 5]\ntarget = [0, -4, 0]\nintensity = 100\ncone_angle = 8",
     kDark,
     1500},
    {"LitForward",
     {0, -4, 0},
     "density_scale = 0.1\nalbedo = 0.6\nphase = { g = 0.7 }",
     "spot",
     "position = [0, -9, 5]\ntarget = [0, -4, 0]\nintensity = 100\ncone_angle = 8",
     kDark,
     25000},
    {"GlowsBeside",
     {0, -2.6, 0},
     "density_scale = 1\nalbedo = 0.6\nemission = { grid = \"flame\" }",
     "",
     "",
     kDark,
     6000},
    {"GlowsFar",
     {0, -9, 0},
     "density_scale = 0\nemission = { grid = \"flame\" }",
     "",
     "",
     kDark,
     100},
    {"ShadowsASun",
     {2.5, 0, 0},
     "density_scale = 0.1\nalbedo = 0",
     "directional",
     "position = [9, 0, 0]\ntarget = [0, 0, 0]\nintensity = 5",
     kSingle,
     40},
    {"ShadowsASky",
     {0, -3, 0},
     "density_scale = 3\nalbedo = 0",
     "environment",
     "intensity = 1",
     kSingle,
     400},
    {"ShadowsWithin",
     {0, -1.7, 0},
     "density_scale = 3\nalbedo = 0",
     "directional",
     "position = [0, -9, 0]\ntarget = [0, 0, 0]\nintensity = 5",
     kDark,
     120},
};

INSTANTIATE_TEST_SUITE_P(Plan, UnseenBound, ::testing::ValuesIn(kRows),
                         [](const auto& row) { return std::string(row.param.label); });

// What the plan of a scene with more volumes and lamps says of its volumes.
class UnseenPlan : public Unseen {
 protected:
  struct Plan {
    std::size_t volumes = 0;
    EffectState state;
  };
  Plan plan(const std::string& more, const std::vector<std::string>& sets = {},
            const SetupOptions& options = {}) const {
    const FrameSetup setup = setUpFrame(scene(more, sets), 1, options);
    Plan plan{setup.medium->volumes().size(), {}};
    for (const EffectState& effect : setup.effectStates)
      if (effect.name == "volumes") plan.state = effect;
    return plan;
  }
  void expectKept(const std::string& more, const std::vector<std::string>& sets = {}) const {
    const Plan plan = this->plan(more, sets);
    EXPECT_EQ(plan.volumes, 2u) << plan.state.why;
    EXPECT_FALSE(plan.state.bound);
  }

  std::string m_far = volume({0, -400, 0}, "density_scale = 3");
  std::string m_farLamp =
      light("spot", "position = [0, -400, 9]\ntarget = [0, -400, 0]\nintensity = 300");
};

TEST_F(UnseenPlan, LeavesOutASmallPuffFarAway) {
  const std::string away =
      volume({0, -30, 0}, "density_scale = 0.04") +
      light("spot", "position = [0, -30, 9]\ntarget = [0, -30, 0]\nintensity = 300");
  const std::vector<std::string> sets{"estimator.type=\"path_traced\"", "volume.0.albedo=0.9",
                                      "volume.1.albedo=0.9", "effects.shadows=\"on\""};
  const Plan without = plan(away, sets);
  EXPECT_EQ(without.volumes, 1u) << without.state.why;
  ASSERT_TRUE(without.state.bound) << without.state.why;
  EXPECT_GT(*without.state.bound, 0.0);
  EXPECT_LE(*without.state.bound, 0.005);
  EXPECT_TRUE(contains(without.state.why, "1 of 2 out of view; light and shadows of 1 change"))
      << without.state.why;

  // Light adds up: what the lamp brings that shines on the puff alone is all that the puff does.
  std::vector<std::string> all = sets;
  all.insert(all.end(), {"effects.tolerance=0", "estimator.samples=1000"});
  const FrameResult picture = renderScene(scene(away, all), 1);
  std::vector<std::string> puffs = sets;
  puffs.insert(puffs.end(), {"effects.tolerance=0", "light.0.intensity=0",
                             fmt::format("estimator.samples={}", kSanitized ? 256 : 32768)});
  const double added = mean(renderScene(scene(away, puffs), 1).layers.beauty);
  const double part = added / mean(picture.layers.beauty);
  fmt::print("  a puff far away: adds {:.3g}, bound {:.3g}\n", part, *without.state.bound);
  EXPECT_LE(part, *without.state.bound);
  if (!kSanitized) {
    EXPECT_GT(part, 0.0);
  }
}

// The picture is the same, but for what a thin haze takes of the sun.
TEST_F(UnseenPlan, LeavesOutAThinHazeBeforeALamp) {
  const std::string sun = light("directional", "position = [9, 0, 0]\ntarget = [0, 0, 0]");
  const std::string haze = volume({2.5, 0, 0}, "density_scale = 3e-4");
  const std::vector<std::string> sets{"estimator.type=\"single\"", "render.samples=64",
                                      "effects.shadows=\"on\"", "light.0.intensity=1"};
  std::vector<std::string> all = sets;
  all.emplace_back("effects.tolerance=0");
  const Plan without = plan(sun + haze, sets), with = plan(sun + haze, all);
  EXPECT_EQ(without.volumes, 1u) << without.state.why;
  EXPECT_EQ(with.volumes, 2u) << with.state.why;
  ASSERT_TRUE(without.state.bound);
  const FrameResult a = renderScene(scene(sun + haze, sets), 1);
  const FrameResult b = renderScene(scene(sun + haze, all), 1);
  double most = 0;
  for (std::size_t i = 0; i < a.layers.beauty.size(); ++i)
    most = std::max(
        most, static_cast<double>(maxComponent(glm::abs(a.layers.beauty[i] - b.layers.beauty[i]))));
  most /= mean(b.layers.beauty);
  fmt::print("  a haze before the sun: takes {:.3g}, bound {:.3g}\n", most, *without.state.bound);
  EXPECT_GT(most, 0.0);
  EXPECT_LE(most, *without.state.bound);
  EXPECT_LE(*without.state.bound, 0.005);
}

TEST_F(UnseenPlan, LeavesOutWhatCannotActWhateverTheTolerance) {
  // Scattered once, and beside all that the lamp shines on.
  const Plan plan = this->plan(volume({0, -40, 0}, "density_scale = 3"),
                               {"estimator.type=\"single\"", "effects.tolerance=0"});
  EXPECT_EQ(plan.volumes, 1u) << plan.state.why;
  EXPECT_EQ(plan.state.bound, 0.0);
  EXPECT_TRUE(contains(plan.state.why, "do not reach what is in view")) << plan.state.why;
}

TEST_F(UnseenPlan, KeepsWhatMayAct) {
  expectKept(volume({0, -2.6, 0}, "density_scale = 3"));
  expectKept(volume({0, -6, 0}, "density_scale = 3"));
  // Between the lamp at (3, 4, 2) and the smoke.
  expectKept(volume({1.8, 2.4, 1.2}, "density_scale = 3"), {"estimator.type=\"single\""});
  expectKept(volume({1.8, 2.4, 1.2}, "density_scale = 0.1"));
  // Far away, but between the sun and the smoke.
  expectKept(volume({150, 0, 0}, "density_scale = 3") +
             light("directional", "position = [9, 0, 0]\ntarget = [0, 0, 0]\nintensity = 5"));
  // Far away, and as bright as that.
  expectKept(
      volume({0, -400, 0},
             "density_scale = 3\nalbedo = 0.9\nemission = { grid = \"flame\", scale = 1e5 }"),
      {"volume.0.albedo=0.9"});
  // A lamp that shines on nothing in view: all its light in the picture comes from the puff.
  expectKept(m_far + m_farLamp, {"light.0.intensity=0", "volume.0.albedo=0.9"});
}

TEST_F(UnseenPlan, KeepsWhatOtherViewsMayShow) {
  const std::vector<std::string> dim{"volume.0.albedo=0.9", "volume.1.albedo=0.9"};
  EXPECT_EQ(plan(m_far, dim).volumes, 1u);
  SetupOptions cache;
  cache.forLightCache = true;
  EXPECT_EQ(plan(m_far, dim, cache).volumes, 2u);
  // A camera that flies past.
  std::vector<std::string> flight = dim;
  flight.emplace_back(
      "camera.position=[{ frame = 0, value = [0, 0, 6] }, { frame = 2, value = [0.1, 0, 6] }]");
  flight.emplace_back("camera.shutter=[-0.25, 0.25]");
  flight.emplace_back("effects.motion_blur=\"on\"");
  expectKept(m_far, flight);

  std::string text = ballScene(m_ball, Vec3d(0), 1, m_far);
  const std::string fov = "fov = 30";
  text.replace(text.find(fov), fov.size(), "type = \"equirectangular\"");
  EXPECT_EQ(
      setUpFrame(parseScene(text, "test.toml", m_folder.path(), dim), 1).medium->volumes().size(),
      2u);
}

// Smoke that comes into the frame while the shutter is open.
TEST_F(UnseenPlan, KeepsWhatMovesIntoView) {
  const Vec3d at(-2.2, 0, 0);
  const int n = 48;
  Mat4d worldFromIndex(0.1);
  worldFromIndex[3] = glm::dvec4(at - 0.1 * (n - 1) / 2.0, 1.0);
  std::vector<float> values;
  for (int i = 0; i < n * n * n; ++i)
    values.insert(values.end(), {1.0f, 0.0f, 0.0f});
  const std::string path = (m_folder / "moves.vdb").string();
  volume::writeVdb(path, {ballGrid("density", at, 0.1),
                          volume::denseVectorToGrid("drift", Vec3i(n), values, worldFromIndex)});
  const std::string moves = fmt::format("[[volume]]\nfile = \"{}\"\nvelocity = \"drift\"\n", path);
  const auto unseen = [&](const std::string& fps) {
    const SceneFile file =
        scene(moves, {"effects.tolerance=0", "effects.motion_blur=\"on\"", "scene.fps=" + fps});
    const FrameSetup setup = setUpFrame(file, 1);
    EXPECT_TRUE(setup.medium->isMoving());
    return UnseenVolumes(file, setup, seenDirections(file, setup)).unseen()[1];
  };
  EXPECT_TRUE(unseen("1000"));
  EXPECT_FALSE(unseen("0.25"));
}

// Through the rim of a lens rays reach beyond the frame of the ray through its middle.
TEST_F(UnseenPlan, KeepsWhatOnlyALensSees) {
  const std::string beside = volume({0, -2.2, -3}, "density_scale = 3");
  const auto seen = [&](const std::vector<std::string>& sets) {
    const SceneFile file = scene(beside, sets);
    const FrameSetup setup = setUpFrame(file, 1);
    return !UnseenVolumes(file, setup, seenDirections(file, setup)).unseen()[1];
  };
  EXPECT_FALSE(seen({"effects.tolerance=0"}));
  EXPECT_FALSE(seen({"effects.tolerance=0", "camera.fstop=16"}));
  EXPECT_TRUE(seen({"effects.tolerance=0", "camera.fstop=0.1", "camera.focus_distance=2",
                    "effects.depth_of_field=\"on\""}));
}

// A puff that is kept is no reason to keep one that is far from it and from the frame.
TEST_F(UnseenPlan, TellsVolumesApart) {
  const Plan plan = this->plan(volume({0, -2.6, 0}, "density_scale = 3\nalbedo = 0.9") +
                                   volume({0, 300, 0}, "density_scale = 3\nalbedo = 0.9") +
                                   volume({300, 0, 0}, "density_scale = 3\nalbedo = 0.9"),
                               {"volume.0.albedo=0.9"});
  EXPECT_EQ(plan.volumes, 2u) << plan.state.why;
  EXPECT_TRUE(contains(plan.state.why, "3 of 4 out of view; light and shadows of 2"))
      << plan.state.why;
}

}  // namespace
}  // namespace photosphere::test
