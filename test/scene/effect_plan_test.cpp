// The effects plan: what it leaves out adds no more than it says, and what it must not leave out
// it keeps.

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "fixture.h"
#include "photosphere/scene/plan.h"

namespace photosphere::test {
namespace {

using namespace scene;

const EffectState& state(const std::vector<EffectState>& effects, const std::string& name) {
  for (const EffectState& effect : effects)
    if (effect.name == name) return effect;
  ADD_FAILURE() << name;
  return effects.front();
}

double sumOfBounds(const std::vector<EffectState>& effects) {
  double sum = 0;
  for (const EffectState& effect : effects)
    sum += effect.bound.value_or(0.0);
  return sum;
}

// One unit a second along x, everywhere about the ball.
volume::Grid drift() {
  const int n = 24;
  Mat4d worldFromIndex(0.1);
  worldFromIndex[3] = glm::dvec4(Vec3d(-0.1 * (n - 1) / 2.0), 1.0);
  std::vector<float> values;
  for (int i = 0; i < n * n * n; ++i)
    values.insert(values.end(), {1.0f, 0.0f, 0.0f});
  return volume::denseVectorToGrid("drift", Vec3i(n), values, worldFromIndex);
}

// Balls of smoke, of flame, of velocity and of albedo that is zero where the smoke is.
std::string writeBall(const TemporaryFolder& folder) {
  const std::string path = (folder / "ball.vdb").string();
  volume::writeVdb(path, {ballGrid("density", Vec3d(0.0), 0.1), ballGrid("flame", Vec3d(0.0), 0.1),
                          ballGrid("black", Vec3d(9.0, 0.0, 0.0), 0.1, 0.9f), drift()});
  return path;
}

struct Row {
  const char* label;
  const char* effect;  // that is left out
  const char* why;     // a part of what is said
  bool exact;          // it adds nothing at all
  std::vector<std::string> sets;
  std::vector<std::string> all = {};  // what simulates it in spite of that
};

void PrintTo(const Row& row, std::ostream* out) {
  *out << row.label;
}

class LeftOut : public ::testing::TestWithParam<Row> {
 protected:
  SceneFile scene(std::vector<std::string> sets) const {
    sets.insert(sets.begin(), {"render.shadow=\"march\"", "estimator.photons=4000"});
    return parseScene(ballScene(m_ball, Vec3d(0), 1, m_lamp), "test.toml", m_folder.path(), sets);
  }
  std::vector<std::string> with(const std::vector<std::string>& more) const {
    std::vector<std::string> sets = GetParam().sets;
    sets.insert(sets.end(), more.begin(), more.end());
    return sets;
  }

  TemporaryFolder m_folder;
  std::string m_ball = writeBall(m_folder);
  // A second lamp, whose strength the rows choose.
  std::string m_lamp =
      "[[light]]\ntype = \"spot\"\nname = \"second\"\nposition = [-5, 1, 3]\nintensity = 80\n";
};

TEST_P(LeftOut, AddsNoMoreThanItsBound) {
  const Row& row = GetParam();
  const SceneFile automatic = scene(row.sets);
  const FrameResult less = renderScene(automatic, 1);
  const EffectState& left = state(less.statistics.effects, row.effect);
  EXPECT_TRUE(contains(left.why, row.why)) << left.why;
  ASSERT_TRUE(left.bound);
  const double tolerance = automatic.effects.real("tolerance");
  EXPECT_EQ(*left.bound == 0.0, row.exact) << *left.bound;
  EXPECT_LE(sumOfBounds(less.statistics.effects), tolerance);
  if (std::string(row.effect) == "multiple_scattering") {
    EXPECT_EQ(less.statistics.lightMemoryBytes, 0u);
    EXPECT_EQ(less.statistics.photonsEmitted, 0u);
  }

  const FrameResult all = renderScene(scene(with(row.all)), 1);
  EXPECT_FALSE(state(all.statistics.effects, row.effect).bound.value_or(0.0) > 0);
  double most = 0, mean = 0, count = 0;
  for (std::size_t i = 0; i < all.layers.beauty.size(); ++i) {
    const Rgb d = glm::abs(all.layers.beauty[i] - less.layers.beauty[i]);
    most = std::max(most, static_cast<double>(maxComponent(d)));
    if (!(all.layers.alpha[i] > 0) && !(maxComponent(all.layers.emission[i]) > 0)) continue;
    mean += static_cast<double>(meanComponent(all.layers.beauty[i]));
    count += 1;
  }
  mean /= std::max(1.0, count);
  ASSERT_GT(mean, 0.0);
  RecordProperty("part", fmt::format("{:.3g}", most / mean));
  fmt::print("  {}: adds {:.3g}, bound {:.3g}\n", row.label, most / mean,
             sumOfBounds(less.statistics.effects));
  EXPECT_LE(most, (sumOfBounds(less.statistics.effects) + 1e-6) * mean);
  if (!row.exact) {
    EXPECT_GT(most, 0.0) << "the two frames do not differ: nothing was tested";
  }
}

TEST_P(LeftOut, IsSimulatedWhereTheToleranceIsLess) {
  const Row& row = GetParam();
  const FrameSetup setup = setUpFrame(scene(row.sets), 1);
  const double bound = sumOfBounds(setup.effectStates);
  const auto at = [&](double tolerance) {
    const FrameSetup again =
        setUpFrame(scene(with({fmt::format("effects.tolerance={:.17g}", tolerance)})), 1);
    return state(again.effectStates, row.effect).bound.value_or(-1.0);
  };
  if (row.exact) {
    EXPECT_EQ(at(0.0), 0.0);
    return;
  }
  EXPECT_GT(at(1.001 * bound), 0.0);
  EXPECT_LT(at(0.0), 0.0);
  // What is left out last is what no longer fits.
  const FrameSetup less =
      setUpFrame(scene(with({fmt::format("effects.tolerance={:.17g}", 0.999 * bound)})), 1);
  EXPECT_LT(sumOfBounds(less.effectStates), 0.999 * bound);
}

const Row kRows[] = {
    {"Thin",
     "multiple_scattering",
     "the smoke is thin",
     false,
     {"volume.0.density_scale=5e-5", "effects.shadows=\"on\"", "camera.resolution=[12, 12]"},
     {"effects.multiple_scattering=\"on\"", "estimator.photons=1000000", "estimator.radius=0.6"}},
    {"ThinIsotropic",
     "multiple_scattering",
     "the smoke is thin",
     false,
     {"volume.0.density_scale=8e-4", "volume.0.phase={ type = \"isotropic\" }",
      "effects.shadows=\"on\"", "camera.resolution=[12, 12]"},
     {"effects.multiple_scattering=\"on\"", "estimator.photons=1000000", "estimator.radius=0.6"}},
    {"ThinForward",
     "multiple_scattering",
     "the smoke is thin",
     false,
     {"volume.0.density_scale=2e-6", "volume.0.phase.g=0.7", "effects.shadows=\"on\"",
      "camera.resolution=[12, 12]"},
     {"effects.multiple_scattering=\"on\"", "estimator.photons=4000000", "estimator.radius=0.6"}},
    {"Shadowless",
     "shadows",
     "the smoke is thin",
     false,
     {"volume.0.density_scale=1e-4", "effects.multiple_scattering=\"off\""},
     {"effects.shadows=\"on\""}},
    {"FaintLamp",
     "lights",
     "without 'second'",
     false,
     {"light.1.intensity=0.005", "estimator.type=\"single\"", "effects.shadows=\"on\""},
     {"effects.single_scattering=\"on\""}},
    {"FaintGlow",
     "emission",
     "the smoke's glow",
     false,
     {"volume.0.emission={ grid = \"flame\", scale = 3e-5 }", "estimator.type=\"single\"",
      "effects.shadows=\"on\""},
     {"effects.emission=\"on\""}},
    {"FineLens",
     "depth_of_field",
     "the lens blurs",
     false,
     {"camera.fstop=400", "estimator.type=\"single\"", "effects.shadows=\"on\"",
      "render.samples=16"},
     {"effects.depth_of_field=\"on\""}},
    // Fine steps, as those of smoke that moves lie elsewhere.
    {"SlowSmoke",
     "motion_blur",
     "the smoke moves",
     false,
     {"volume.0.velocity=\"drift\"", "scene.fps=4800", "estimator.type=\"single\"",
      "effects.shadows=\"off\"", "render.samples=64", "render.step=0.1",
      "camera.resolution=[12, 12]"},
     {"effects.motion_blur=\"on\""}},
    {"NoEmission",
     "emission",
     "zero everywhere",
     true,
     {"volume.0.emission={ grid = \"flame\", scale = 0 }", "estimator.type=\"single\""},
     {"effects.emission=\"on\""}},
    {"LampThatMisses",
     "lights",
     "no light of 'second'",
     true,
     {"light.1.target=[-9, 8, 3]", "estimator.type=\"single\""},
     {"effects.single_scattering=\"on\""}},
    {"BlackSky",
     "environment",
     "black",
     true,
     {"light.1={ type = \"environment\", intensity = 0 }", "estimator.type=\"single\""},
     {"effects.environment=\"on\""}},
    {"AlbedoZeroInTheSmoke",
     "multiple_scattering",
     "only absorbs",
     true,
     {"volume.0.albedo=\"black\"", "volume.0.emission={ grid = \"flame\" }"},
     {"effects.multiple_scattering=\"on\""}},
    {"Grey",
     "chromatic",
     "grey",
     true,
     {"estimator.type=\"single\""},
     {"effects.chromatic=\"on\""}},
    {"Pinhole", "depth_of_field", "pinhole", true, {"estimator.type=\"single\""}},
    {"AtRest", "motion_blur", "no volume has a velocity", true, {"estimator.type=\"single\""}},
};

INSTANTIATE_TEST_SUITE_P(Plan, LeftOut, ::testing::ValuesIn(kRows),
                         [](const auto& row) { return std::string(row.param.label); });

class PlanScene : public ::testing::Test {
 protected:
  SceneFile scene(const std::vector<std::string>& sets, const std::string& more = {}) const {
    return parseScene(ballScene(m_ball, Vec3d(0), 1, more), "test.toml", m_folder.path(), sets);
  }
  TemporaryFolder m_folder;
  std::string m_ball = writeBall(m_folder);
};

TEST_F(PlanScene, ThickSmokeKeepsEverythingWithoutLookingAtIt) {
  const FrameSetup setup = setUpFrame(scene({}), 1);
  EXPECT_TRUE(setup.effects.multipleScattering);
  EXPECT_TRUE(setup.effects.shadows);
  EXPECT_FALSE(state(setup.effectStates, "shadows").bound);
}

TEST_F(PlanScene, WhatIsOnInTheSceneIsOnAndWhatIsOffIsOff) {
  const std::vector<std::string> thin{"volume.0.density_scale=1e-5"};
  for (const char* name : {"multiple_scattering", "shadows", "single_scattering", "emission",
                           "environment", "chromatic"}) {
    for (const char* wish : {"on", "off"}) {
      std::vector<std::string> sets = thin;
      sets.push_back(fmt::format("effects.{}=\"{}\"", name, wish));
      const FrameResult r = renderScene(scene(sets), 1);
      EXPECT_EQ(state(r.statistics.effects, name).on, std::string(wish) == "on") << name;
      EXPECT_FALSE(state(r.statistics.effects, name).bound) << name;
    }
  }
}

TEST_F(PlanScene, StoresNoDirectionsWhereNonePlaysAPart) {
  const std::vector<std::string> even{"volume.0.phase={ type = \"isotropic\" }",
                                      "estimator.evaluate=\"per_step\""};
  std::vector<std::string> binned = even;
  binned.push_back("estimator.basis=\"histogram\"");
  EXPECT_EQ(setUpFrame(scene(even), 1).layout.bins(), 1);
  EXPECT_GT(setUpFrame(scene(binned), 1).layout.bins(), 1);
  EXPECT_FALSE(state(setUpFrame(scene(even), 1).effectStates, "directions").on);
  const FrameResult one = renderScene(scene(even), 1), many = renderScene(scene(binned), 1);
  for (std::size_t i = 0; i < one.layers.beauty.size(); ++i)
    EXPECT_NEAR(one.layers.multiple[i].x, many.layers.multiple[i].x,
                1e-3f * many.layers.multiple[i].x + 1e-5f);
}

// A ball that no camera ray meets, beside the one in view.
class BesideTheView : public PlanScene {
 protected:
  std::string beside(const Vec3d& at) const {
    const std::string path = (m_folder / "beside.vdb").string();
    volume::writeVdb(path, {ballGrid("density", at, 0.1)});
    return fmt::format("[[volume]]\nfile = \"{}\"\ndensity_scale = 3\nphase = {{ g = 0.3 }}\n",
                       path);
  }
  static double mean(const std::vector<Rgb>& pixels) {
    double sum = 0;
    for (const Rgb& p : pixels)
      sum += static_cast<double>(meanComponent(p)) / static_cast<double>(pixels.size());
    return sum;
  }
  FrameResult render(const std::string& more, std::vector<std::string> sets = {},
                     const RenderRequest& request = {}) const {
    sets.insert(sets.begin(), {"estimator.photons=200000", "estimator.basis=\"view\"",
                               "camera.fov=20", "light.0.intensity=400"});
    return renderScene(scene(sets, more), 1, request);
  }
};

TEST_F(BesideTheView, SmokeStillShadows) {
  // In the way of the lamp at (3, 4, 2).
  const FrameResult alone = render(""), shaded = render(beside({1.6, 2.2, 1.1}));
  EXPECT_LT(mean(shaded.layers.single), 0.5 * mean(alone.layers.single));
}

TEST_F(BesideTheView, SmokeStillScattersLightIntoTheView) {
  // A lamp that lights the ball below the view, and nothing in it.
  const std::vector<std::string> below{"light.0.position=[0, -2.3, 5]",
                                       "light.0.target=[0, -2.3, 0]", "light.0.cone_angle=8"};
  const FrameResult alone = render("", below), lit = render(beside({0.0, -2.3, 0.0}), below);
  EXPECT_EQ(mean(alone.layers.beauty), 0.0);
  EXPECT_EQ(mean(lit.layers.single), 0.0);
  EXPECT_GT(mean(lit.layers.multiple), 1e-3);

  // Three times the width at the same pixels: the middle third is the same view.
  const double wideFov = 2 * std::atan(3 * std::tan(10 * kPi / 180)) * 180 / kPi;
  std::vector<std::string> wide = below;
  wide.push_back(fmt::format("camera.fov={:.17g}", wideFov));
  RenderRequest middle;
  middle.resolution = Vec2i(96, 96);
  middle.crop = render::Crop{{32, 32}, {64, 64}};
  const FrameResult cut = render(beside({0.0, -2.3, 0.0}), wide, middle);
  ASSERT_EQ(cut.layers.beauty.size(), lit.layers.beauty.size());
  EXPECT_NEAR(mean(cut.layers.multiple), mean(lit.layers.multiple),
              5e-3 * mean(lit.layers.multiple));
}

TEST_F(PlanScene, ItsJsonSaysWhatItsTextSays) {
  const FramePlan plan = planScene(scene({"volume.0.density_scale=1e-5"}), 7);
  const auto json = nlohmann::json::parse(planJson(plan));
  EXPECT_EQ(json["frame"], 7);
  EXPECT_EQ(json["effects"].size(), plan.effects.size());
  EXPECT_FALSE(json["effects"]["multiple_scattering"]["on"]);
  EXPECT_GT(json["effects"]["multiple_scattering"]["bound"], 0.0);
  EXPECT_TRUE(json["effects"]["single_scattering"]["bound"].is_null());
  EXPECT_GT(json["seconds"]["total"], 0.0);
  EXPECT_EQ(json["seconds"]["trace"], 0.0);
  EXPECT_EQ(json["memory_bytes"]["light"], 0);
  EXPECT_TRUE(contains(planLine(plan.effects), "single_scattering, "));
  EXPECT_TRUE(contains(planLine(plan.effects), "off: emission (no volume emits), "));
}

TEST_F(PlanScene, PredictsLightAndItsMemory) {
  for (const std::string type : {"photosphere", "photon_map", "path_traced", "light_traced"}) {
    const FramePlan plan = planScene(scene({fmt::format("estimator.type=\"{}\"", type)}), 1);
    EXPECT_GT(plan.seconds.march, 0.0) << type;
    EXPECT_EQ(plan.seconds.trace > 0, type != "path_traced") << type;
    EXPECT_EQ(plan.memory.light > 0, type == "photosphere" || type == "photon_map") << type;
  }
}

}  // namespace
}  // namespace photosphere::test
