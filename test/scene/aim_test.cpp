// Photons and light voxels where the picture can see their effect.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "fixture.h"

namespace photosphere::test {
namespace {

using namespace scene;

class AimScene : public ::testing::Test {
 protected:
  SceneFile make(const std::vector<std::string>& sets, double edge = 0.1) {
    const std::string path = (m_folder / "ball.vdb").string();
    volume::writeVdb(path, {ballGrid("density", Vec3d(0.0), edge)});
    return parseScene(ballScene(path, Vec3d(0), 1), "t.toml", m_folder.path(), sets);
  }
  // A corner of the ball fills the frame.
  static std::vector<std::string> closeUp(const std::string& importance,
                                          const std::vector<std::string>& more = {}) {
    std::vector<std::string> sets{"camera.look_at=[-0.5, -0.4, 0]", "camera.fov=4",
                                  "volume.0.density_scale=6", "estimator.importance=" + importance};
    sets.insert(sets.end(), more.begin(), more.end());
    return sets;
  }
  static double mean(const std::vector<Rgb>& pixels) {
    double sum = 0;
    for (const Rgb& p : pixels)
      sum += static_cast<double>(meanComponent(p)) / static_cast<double>(pixels.size());
    return sum;
  }
  // Relative noise of the mean over seeds.
  double noise(const std::vector<std::string>& sets) {
    std::vector<double> means;
    for (int seed = 1; seed <= 6; ++seed) {
      std::vector<std::string> seeded = sets;
      seeded.push_back(fmt::format("scene.seed={}", seed));
      means.push_back(mean(renderScene(make(seeded), 1).layers.multiple));
    }
    double sum = 0, squares = 0;
    for (const double m : means)
      sum += m / 6;
    for (const double m : means)
      squares += (m - sum) * (m - sum) / 5;
    return std::sqrt(squares) / sum;
  }
  static bool steered(const FrameResult& r) {
    return std::any_of(r.notes.begin(), r.notes.end(),
                       [](const std::string& note) { return contains(note, "photons go where"); });
  }

  TemporaryFolder m_folder;
};

TEST_F(AimScene, SteeringIsUnbiased) {
  const RunOnly runOnly;
  const std::vector<std::vector<std::string>> lamps = {
      {},
      {"light=[{ type = \"rect\", position = [3, 3, 1], target = [0, 0, 0], size = [1, 1], "
       "intensity = 30 }]"},
      {"light=[{ type = \"spot\", position = [3, 4, 2], target = [1.5, -1, 0], intensity = 100, "
       "cone_angle = 12 }, { type = \"point\", position = [0, 0.3, 0.2], intensity = 2 }]"},
      {"light=[{ type = \"directional\", position = [0, 1, 0], target = [0, 0, 0], intensity = 3 "
       "}]",
       "volume.0.emission={ grid = \"density\", scale = 0.1 }"},
  };
  for (const auto& lamp : lamps) {
    std::vector<std::string> sets = lamp;
    sets.push_back(fmt::format("estimator.photons={}", fewer(150000)));
    sets.push_back("camera.fov=9");
    const FrameResult even = renderScene(make(closeUp("off", sets)), 1);
    const FrameResult aimed = renderScene(make(closeUp("on", sets)), 1);
    EXPECT_FALSE(steered(even));
    EXPECT_TRUE(steered(aimed));
    EXPECT_NEAR(mean(aimed.layers.multiple), mean(even.layers.multiple),
                0.05 * mean(even.layers.multiple))
        << (lamp.empty() ? "spot" : lamp.front());
    EXPECT_NEAR(mean(aimed.layers.single), mean(even.layers.single),
                0.06 * mean(even.layers.single) + 1e-9);
    for (int c = 0; c < 3; ++c) {
      const double emitted = aimed.statistics.energyEmitted[c];
      EXPECT_NEAR(aimed.statistics.energyError[c], 0.0, 1e-9 * emitted);
      EXPECT_NEAR(emitted, even.statistics.energyEmitted[c], 0.02 * emitted);
      // Roulette and splitting take on the mean what they give.
      EXPECT_NEAR(aimed.statistics.energyEscaped[c], even.statistics.energyEscaped[c],
                  0.03 * emitted);
    }
    // The photon map is steered as well.
    sets.push_back("estimator.type=photon_map");
    sets.push_back("estimator.radius=0.15");
    EXPECT_NEAR(mean(renderScene(make(closeUp("on", sets)), 1).layers.multiple),
                mean(renderScene(make(closeUp("off", sets)), 1).layers.multiple),
                0.05 * mean(even.layers.multiple));
  }
}

TEST_F(AimScene, SteeringLowersTheNoiseOfACloseUp) {
  const RunOnly runOnly;
  const std::vector<std::string> few{fmt::format("estimator.photons={}", fewer(4000))};
  EXPECT_LT(noise(closeUp("on", few)), 0.7 * noise(closeUp("off", few)));
}

TEST_F(AimScene, AutoSteersWhereMuchIsNotSeen) {
  EXPECT_FALSE(steered(renderScene(make({}), 1)));
  EXPECT_TRUE(steered(renderScene(make(closeUp("auto")), 1)));
  EXPECT_TRUE(steered(renderScene(
      make({"light=[{ type = \"spot\", position = [3, 4, 2], target = [1.52, -1.14, 0], "
            "intensity = 100, cone_angle = 8 }]"}),
      1)));
}

// Light voxels beyond the frame are not stored, which changes no pixel.
TEST_F(AimScene, UnseenVoxelsAreNotStored) {
  const SceneFile scene = make({"estimator.light_voxel=1", "estimator.radius=0.04"}, 0.04);
  const FrameResult whole = renderScene(scene, 1);
  RenderRequest request;
  request.crop = render::Crop{Vec2i(7, 14), Vec2i(11, 18)};
  const FrameResult part = renderScene(scene, 1, request);
  EXPECT_LT(part.statistics.lightMemoryBytes, whole.statistics.lightMemoryBytes / 2);
  ASSERT_EQ(part.layers.width(), 4);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) {
      const Rgb& a = part.layers.multiple[static_cast<std::size_t>(y * 4 + x)];
      const Rgb& b = whole.layers.multiple[static_cast<std::size_t>((y + 14) * 32 + x + 7)];
      EXPECT_EQ(a, b) << x << ", " << y;
      EXPECT_GT(b.x, 0.0f);
    }
}

}  // namespace
}  // namespace photosphere::test
