// Smoke that moves and coloured extinction, from the scene file to the frame.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "fixture.h"

namespace photosphere::test {
namespace {

using namespace scene;

class MovingScene : public ::testing::Test {
 protected:
  // A ball that flies to the right; @param speed  [scene units/s]
  SceneFile make(const std::vector<std::string>& sets, double speed = 12.0) {
    const std::string path = (m_folder / "ball.vdb").string();
    const volume::Grid ball = ballGrid("density", Vec3d(0.0), 0.1);
    const int n = 24;
    std::vector<float> v;
    for (int i = 0; i < n * n * n; ++i)
      v.insert(v.end(), {static_cast<float>(speed), 0.0f, 0.0f});
    const volume::Grid velocity =
        volume::denseVectorToGrid("v", Vec3i(n), v, ball.worldFromIndex(), Vec3i(0));
    volume::writeVdb(path, {ball, velocity});
    return parseScene(ballScene(path, Vec3d(0), 1), "t.toml", m_folder.path(), sets);
  }
  // Where the smoke stands in the frame: mean of x by alpha, and its spread [pixels].
  struct Place {
    double x = 0, spread = 0, sum = 0;
  };
  static Place place(const FrameResult& r) {
    Place p;
    double squares = 0;
    for (int y = 0; y < r.layers.height(); ++y)
      for (int x = 0; x < r.layers.width(); ++x) {
        const auto a =
            static_cast<double>(r.layers.alpha[static_cast<std::size_t>(y * r.layers.width() + x)]);
        p.sum += a;
        p.x += a * (x + 0.5);
        squares += a * (x + 0.5) * (x + 0.5);
      }
    p.x /= p.sum;
    p.spread = std::sqrt(std::max(0.0, squares / p.sum - p.x * p.x));
    return p;
  }

  TemporaryFolder m_folder;
};

// 12 units a second for half a frame at 24 frames a second: a quarter of a unit, 2.5 pixels.
TEST_F(MovingScene, BlursAlongItsWay) {
  const std::vector<std::string> sets{"volume.0.velocity=v", "render.samples=16",
                                      "effects.motion_blur=on"};
  const Place still = place(renderScene(make({"render.samples=16"}), 1));
  const FrameResult moving = renderScene(make(sets), 1);
  const Place around = place(moving);
  EXPECT_NEAR(around.x, still.x, 0.1) << "the shutter opens as long before the frame as after";
  // Variances add: that of an even spread over L pixels is L^2 / 12.
  const double pixels = 0.25 * 32 / (2 * 6 * std::tan(15 * 3.14159265 / 180));
  EXPECT_NEAR(around.spread * around.spread - still.spread * still.spread, pixels * pixels / 12,
              0.25);
  EXPECT_NEAR(around.sum, still.sum, 0.02 * still.sum);

  std::vector<std::string> late = sets;
  late.emplace_back("camera.shutter=[0.5, 1.0]");
  const double shift = 12.0 * 0.75 / 24 * 32 / (2 * 6 * std::tan(15 * 3.14159265 / 180));
  EXPECT_NEAR(place(renderScene(make(late), 1)).x - still.x, shift, 0.15);
}

TEST_F(MovingScene, PathsAndPhotonsAgree) {
  const RunOnly runOnly;
  const auto mean = [](const std::vector<Rgb>& pixels) {
    double sum = 0;
    for (const Rgb& p : pixels)
      sum += static_cast<double>(meanComponent(p)) / static_cast<double>(pixels.size());
    return sum;
  };
  const std::vector<std::string> sets{"volume.0.velocity=v", "render.samples=16",
                                      fmt::format("estimator.photons={}", fewer(200000)),
                                      fmt::format("estimator.samples={}", fewer(256))};
  const FrameResult photons = renderScene(make(sets), 1);
  std::vector<std::string> paths = sets;
  paths.emplace_back("estimator.type=path_traced");
  const FrameResult truth = renderScene(make(paths), 1);
  EXPECT_NEAR(mean(photons.layers.multiple), mean(truth.layers.multiple),
              0.03 * mean(truth.layers.multiple));
  EXPECT_NEAR(mean(photons.layers.single), mean(truth.layers.single),
              0.03 * mean(truth.layers.single));
  EXPECT_EQ(photons.statistics.majorantViolations + truth.statistics.majorantViolations, 0u);
}

TEST_F(MovingScene, IsNotForPathsFromTheLamps) {
  const std::vector<std::string> sets{"volume.0.velocity=v", "estimator.type=light_traced"};
  try {
    renderScene(make(sets), 1);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_TRUE(contains(error.what(), "effects.motion_blur"));
  }
  std::vector<std::string> still = sets;
  still.insert(still.end(), {"effects.motion_blur=off", "estimator.samples=8"});
  const FrameResult frame = renderScene(make(still), 1);
  EXPECT_GT(frame.statistics.photonsEmitted, 0u);
  EXPECT_GT(frame.statistics.seconds.trace, 0.0);
}

TEST_F(MovingScene, MovesOnlyWhereItIsSeenOrAskedFor) {
  const auto setup = [&](const std::vector<std::string>& sets, double speed = 12.0) {
    return setUpFrame(make(sets, speed), 1);
  };
  const std::string blurred = "volume.0.velocity=v";
  EXPECT_TRUE(setup({blurred}).medium->isMoving());
  EXPECT_TRUE(setup({blurred}).effects.motionBlur);
  for (const std::vector<std::string>& sets : {std::vector<std::string>{},
                                               {blurred, "effects.motion_blur=off"},
                                               {blurred, "camera.shutter=[0, 0]"}}) {
    const FrameSetup still = setup(sets);
    EXPECT_FALSE(still.medium->isMoving());
    EXPECT_FALSE(still.effects.motionBlur);
    EXPECT_EQ(still.medium->hash(), setup({}).medium->hash());
  }
  // Slower than a picture can show.
  EXPECT_FALSE(setup({blurred}, 1e-5).medium->isMoving());
  EXPECT_TRUE(setup({blurred, "effects.motion_blur=on"}, 1e-5).medium->isMoving());
}

TEST_F(MovingScene, RefusesVelocitiesThatAreNone) {
  EXPECT_TRUE(contains(
      complaint([&] { setUpFrame(make({"volume.0.velocity=speed"}), 1); }, ExitCode::inputInvalid),
      "no grid is named 'speed'"));
  EXPECT_TRUE(contains(complaint([&] { setUpFrame(make({"volume.0.velocity=density"}), 1); },
                                 ExitCode::inputInvalid),
                       "a velocity is a vector a voxel"));
}

TEST_F(MovingScene, ColouredExtinctionHasThreeChannels) {
  const FrameResult r = renderScene(make({"volume.0.density_scale=[0.5, 2, 6]"}), 1);
  double red = 0, blue = 0;
  for (const Rgb& t : r.layers.transmittance) {
    red += static_cast<double>(t.x);
    blue += static_cast<double>(t.z);
  }
  EXPECT_GT(red, 1.05 * blue);
  EXPECT_TRUE(setUpFrame(make({"volume.0.density_scale=[0.5, 2, 6]"}), 1).effects.chromatic);
  EXPECT_FALSE(setUpFrame(make({"volume.0.density_scale=[2, 2, 2]"}), 1).effects.chromatic);
  // One number for all is what it was.
  EXPECT_EQ(setUpFrame(make({"volume.0.density_scale=[2, 2, 2]"}), 1).medium->hash(),
            setUpFrame(make({"volume.0.density_scale=2"}), 1).medium->hash());
  EXPECT_NE(complaint([&] {
              setUpFrame(make({"volume.0.density_scale=[1, 2, 3]", "effects.chromatic=off"}), 1);
            }),
            "");
}

// Light that rides with the smoke is cached with it: another shutter is another medium.
TEST_F(MovingScene, ALightCacheKnowsTheShutter) {
  const std::vector<std::string> sets{"volume.0.velocity=v"};
  const std::string cache = (m_folder / "light.vdb").string();
  traceScene(make(sets), 1, cache);
  std::vector<std::string> cached = sets;
  cached.push_back("estimator.cache=" + cache);
  EXPECT_NO_THROW(renderScene(make(cached), 1));
  cached.emplace_back("camera.shutter=[-0.4, 0.4]");
  EXPECT_THROW(renderScene(make(cached), 1), Error);
}

}  // namespace
}  // namespace photosphere::test
