// Every scene of data/scenes renders.

#include <gtest/gtest.h>

#include <algorithm>

#include "fixture.h"

namespace photosphere::test {
namespace {

using namespace scene;

std::vector<std::filesystem::path> shippedScenes() {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(projectFile("data/scenes")))
    if (entry.path().extension() == ".toml") paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  return paths;
}

class ShippedScene : public ::testing::TestWithParam<std::filesystem::path> {};

TEST_P(ShippedScene, RendersFiniteAndNotBlack) {
  std::vector<std::string> sets{"camera.resolution=[48, 27]", "estimator.photons=3000",
                                "render.samples=1"};
  const SceneFile written = loadScene(GetParam());
  for (std::size_t i = 0; i < written.volumes.size(); ++i) {
    // Those that ./demo converts first, as the files that they are converted from.
    const std::string file = written.volumes[i].values.text("file");
    if (!contains(file, "out/demo")) continue;
    const bool column = contains(file, "column");
    sets.push_back(fmt::format(
        "volume.{}.file=\"{}\"", i,
        projectFile(column ? "data/caches/column_0042.vdb" : "data/caches/mushroom_0038.vdb")
            .string()));
    sets.push_back(
        fmt::format("volume.{}.origin={}", i, column ? "[-2, -2, 0]" : "[-2.5, -2.5, 0]"));
    sets.push_back(fmt::format("volume.{}.cell_centered=true", i));
  }
  const FrameResult r = renderScene(loadScene(GetParam(), sets), sceneFrames(written).front());
  double sum = 0, smoke = 0;
  for (std::size_t i = 0; i < r.layers.beauty.size(); ++i) {
    const Rgb& pixel = r.layers.beauty[i];
    ASSERT_TRUE(std::isfinite(pixel.x + pixel.y + pixel.z));
    sum += static_cast<double>(meanComponent(pixel));
    smoke += static_cast<double>(r.layers.alpha[i]);
  }
  const auto pixels = static_cast<double>(r.layers.beauty.size());
  EXPECT_EQ(r.layers.beauty.size(), std::size_t{48} * 27);
  // Not black, not burnt out, and the smoke in view; haze hides next to nothing.
  EXPECT_GT(sum / pixels, 1e-3);
  EXPECT_LT(sum / pixels, 10.0);
  EXPECT_GT(smoke / pixels, GetParam().stem() == "haze" ? 1e-6 : 0.01);
}

INSTANTIATE_TEST_SUITE_P(Data, ShippedScene, ::testing::ValuesIn(shippedScenes()),
                         [](const auto& row) { return row.param.stem().string(); });

// What each scene is there to show is on.
TEST(ShippedScenes, ShowTheEffectThatTheyAreNamedAfter) {
  const std::pair<const char*, bool Effects::*> shown[] = {
      {"emission", &Effects::emission},           {"environment", &Effects::environment},
      {"depth_of_field", &Effects::depthOfField}, {"motion_blur", &Effects::motionBlur},
      {"camera_motion", &Effects::motionBlur},    {"chromatic", &Effects::chromatic},
  };
  for (const auto& [name, flag] : shown) {
    const SceneFile scene = loadScene(projectFile(fmt::format("data/scenes/{}.toml", name)));
    EXPECT_TRUE(setUpFrame(scene, 1).effects.*flag) << name;
  }
}

}  // namespace
}  // namespace photosphere::test
