// `emission` of a volume: from the scene file to the layer.

#include <gtest/gtest.h>

#include "fixture.h"
#include "photosphere/image/blackbody.h"
#include "photosphere/image/color.h"

namespace photosphere::test {
namespace {

using namespace scene;

class EmissionScene : public ::testing::Test {
 protected:
  // A ball of smoke and, twice as wide as the view needs, a flame of value 2 beside it.
  std::string cache() {
    const std::string path = (m_folder / "fire.vdb").string();
    volume::writeVdb(path, {ballGrid("density", Vec3d(0.0), 0.1),
                            ballGrid("flame", Vec3d(0.7, 0.0, 0.0), 0.1, 2.0f),
                            ballGrid("kelvin", Vec3d(0.7, 0.0, 0.0), 0.1, 1.5f)});
    return path;
  }
  FrameResult render(const std::string& emission, const std::vector<std::string>& sets = {}) {
    std::vector<std::string> all{"volume.0.emission=" + emission};
    all.insert(all.end(), sets.begin(), sets.end());
    return renderScene(
        parseScene(ballScene(cache(), Vec3d(0), 1), "test.toml", m_folder.path(), all), 1);
  }
  static Vec3d mean(const std::vector<Rgb>& pixels) {
    Vec3d sum(0.0);
    for (const Rgb& p : pixels)
      sum += Vec3d(p) / static_cast<double>(pixels.size());
    return sum;
  }
  static const EffectState& effect(const FrameResult& r, const std::string& name) {
    for (const EffectState& state : r.statistics.effects)
      if (state.name == name) return state;
    ADD_FAILURE() << name;
    return r.statistics.effects.front();
  }

  TemporaryFolder m_folder;
};

TEST_F(EmissionScene, FlamesShineAndLightTheSmoke) {
  const FrameResult dark = render("{ grid = \"flame\", scale = 0 }");
  const FrameResult lit = render("{ grid = \"flame\", scale = 3, color = [1, 0.5, 0.25] }");
  EXPECT_FALSE(effect(dark, "emission").on);
  EXPECT_TRUE(effect(lit, "emission").on);
  EXPECT_TRUE(effect(lit, "chromatic").on);
  const auto has = [](const FrameResult& r, const char* layer) {
    return std::find(r.layerNames.begin(), r.layerNames.end(), layer) != r.layerNames.end();
  };
  EXPECT_FALSE(has(dark, "emission"));
  EXPECT_TRUE(has(lit, "emission"));
  const Vec3d glow = mean(lit.layers.emission);
  EXPECT_GT(glow.x, 0.1);
  EXPECT_NEAR(glow.y / glow.x, 0.5, 1e-3);
  EXPECT_NEAR(glow.z / glow.x, 0.25, 1e-3);
  EXPECT_GT(mean(lit.layers.multiple).x, mean(dark.layers.multiple).x + 0.05);
  // Single scattering is the lamps' alone.
  EXPECT_NEAR(mean(lit.layers.single).x, mean(dark.layers.single).x,
              0.03 * mean(dark.layers.single).x);
  EXPECT_GT(lit.statistics.energyEmitted.x, dark.statistics.energyEmitted.x);
  EXPECT_NEAR(lit.statistics.energyError.x, 0.0, 1e-6 * lit.statistics.energyEmitted.x);
}

TEST_F(EmissionScene, RadianceIsTheLineIntegralInMetres) {
  // No smoke in the way: through the flame's middle 2 * 3 * 2 m; a centimetre scene is 100 times
  // shorter in its own units and no brighter or darker in metres.
  for (const double unit : {1.0, 100.0}) {
    const std::string path = (m_folder / "plain.vdb").string();
    Mat4d m(unit);
    m[3] = glm::dvec4(0, 0, 0, 1);
    volume::writeVdb(path, {volume::transformed(ballGrid("density", Vec3d(0.0), 0.1), m),
                            volume::transformed(ballGrid("flame", Vec3d(0.0), 0.1, 2.0f), m)});
    const SceneFile s = parseScene(
        ballScene(path, Vec3d(0), unit), "test.toml", m_folder.path(),
        {"volume.0.emission={ grid = \"flame\", scale = 3 }", "volume.0.density_scale=0"});
    const FrameResult r = renderScene(s, 1);
    EXPECT_NEAR(static_cast<double>(r.layers.emission[16 * 32 + 16].x), 12.0, 0.4) << unit;
    EXPECT_EQ(mean(r.layers.transmittance).x, 1.0);
    EXPECT_FALSE(effect(r, "multiple_scattering").on);
  }
}

TEST_F(EmissionScene, TemperaturesGiveTheRadianceOfABlackBody) {
  const FrameResult r =
      render("{ temperature = \"kelvin\", kelvin_scale = 1000, kelvin_offset = 500, scale = 0.01 }",
             {"volume.0.density_scale=0"});
  const Vec3d glow = mean(r.layers.emission);
  const Vec3d exact =
      image::rgbFromXyz(*image::knownChromaticities("ACEScg")) * image::blackbodyXyz(2000);
  ASSERT_GT(glow.x, 0.0);
  EXPECT_GT(exact.z, 0.0);
  // Interpolation towards the ball's dark surroundings is of radiance, which keeps its colour.
  EXPECT_NEAR(glow.y / glow.x, exact.y / exact.x, 1e-3 * exact.y / exact.x);
  EXPECT_NEAR(glow.z / glow.x, exact.z / exact.x, 1e-3 * exact.z / exact.x);
  double most = 0;
  for (const Rgb& p : r.layers.emission)
    most = std::max(most, static_cast<double>(p.x));
  EXPECT_NEAR(most, 0.01 * exact.x * 2.0, 0.05 * most);
  // In a small space, a cool body's blue is below zero: clipped, and said.
  const FrameResult narrow =
      render("{ temperature = \"kelvin\", kelvin_scale = 800, scale = 0.01 }",
             {"output.colorspace=lin_rec709"});
  EXPECT_EQ(mean(narrow.layers.emission).z, 0.0);
  const auto says = [](const FrameResult& frame, const char* word) {
    return std::any_of(frame.notes.begin(), frame.notes.end(),
                       [&](const std::string& note) { return contains(note, word); });
  };
  EXPECT_TRUE(says(narrow, "clipped"));
  EXPECT_FALSE(says(r, "clipped"));
  // Numbers that are no kelvin stay dark, and that is said.
  const FrameResult cold = render("{ temperature = \"kelvin\" }");
  EXPECT_FALSE(effect(cold, "emission").on);
  EXPECT_TRUE(says(cold, "kelvin_scale"));
}

TEST_F(EmissionScene, OffIsAsIfThereWereNone) {
  const FrameResult none =
      renderScene(parseScene(ballScene(cache(), Vec3d(0), 1), "t", m_folder.path()), 1);
  const FrameResult off = render("{ grid = \"flame\", scale = 3 }", {"effects.emission=off"});
  EXPECT_EQ(off.layers.beauty, none.layers.beauty);
  EXPECT_EQ(off.statistics.mediumHash, none.statistics.mediumHash);
  const FrameResult on = render("{ grid = \"flame\", scale = 3 }", {"effects.emission=on"});
  EXPECT_NE(on.statistics.mediumHash, none.statistics.mediumHash);
}

TEST_F(EmissionScene, LightsTheSmokeWithoutAnyLamp) {
  std::string text = ballScene(cache(), Vec3d(0), 1);
  const std::size_t lamp = text.find("[[light]]");
  text.erase(lamp, text.find("[estimator]") - lamp);
  const FrameResult r = renderScene(
      parseScene(text, "t", m_folder.path(), {"volume.0.emission={ grid = \"flame\" }"}), 1);
  EXPECT_FALSE(effect(r, "single_scattering").on);
  EXPECT_GT(mean(r.layers.multiple).x, 0.01);
  EXPECT_EQ(r.statistics.photonsStored,
            r.statistics.photonsScattered + r.statistics.photonsEmitted);
}

TEST_F(EmissionScene, WrongTablesAreRefused) {
  const auto parse = [&](const std::string& emission) {
    return complaint([&] {
      parseScene("[[volume]]\nfile = \"a.vdb\"\nemission = " + emission + "\n", "shot.toml", {});
    });
  };
  EXPECT_TRUE(contains(parse("3"), "shot.toml:3")) << parse("3");
  EXPECT_TRUE(contains(parse("{ scale = 3 }"), "needs either 'grid' or 'temperature'"));
  EXPECT_TRUE(contains(parse("{ grid = \"a\", temperature = \"b\" }"), "either"));
  EXPECT_TRUE(
      contains(parse("{ grid = \"a\", kelvin_scale = 3.0 }"), "'kelvin_scale' does not go"));
  EXPECT_TRUE(contains(parse("{ temperature = \"a\", color = [1, 0, 0] }"), "'color' does not go"));
  EXPECT_TRUE(contains(parse("{ grid = \"a\", scale = -1.0 }"), "at least 0"));
  EXPECT_TRUE(contains(parse("{ grid = \"a\", colour = 1.0 }"), "did you mean 'color'?"));
  EXPECT_EQ(parse("{ grid = \"a\", scale = 2.0, color = [1, 0, 0] }"), "");
  const std::string missing =
      complaint([&] { render("{ grid = \"fire\" }"); }, ExitCode::inputInvalid);
  EXPECT_TRUE(contains(missing, "no grid is named 'fire'")) << missing;
  EXPECT_TRUE(contains(missing, "'flame'")) << missing;
}

TEST_F(EmissionScene, DumpsReadBackTheSame) {
  const SceneFile s = parseScene(
      "[[volume]]\nfile = \"a.vdb\"\nalbedo = \"scatter\"\n"
      "emission = { temperature = \"t\", kelvin_scale = 1200.0, scale = 0.25 }\n",
      "shot.toml", "/tmp");
  const SceneFile again = parseScene(dumpScene(s), "dump", "/tmp");
  EXPECT_EQ(again.hash(), s.hash());
  EXPECT_EQ(again.volumes.at(0).emission.real("kelvin_scale"), 1200.0);
  EXPECT_TRUE(again.volumes.at(0).emits);
  const SceneFile other = parseScene(dumpScene(s), "dump", "/tmp", {"volume.0.emission.scale=0.5"});
  EXPECT_NE(other.hash(), s.hash());
}

}  // namespace
}  // namespace photosphere::test
