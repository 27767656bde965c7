// Final gathering and spherical harmonics from the scene file.

#include <gtest/gtest.h>

#include "fixture.h"

namespace photosphere::test {
namespace {

using namespace scene;

class GatherScene : public ::testing::Test {
 protected:
  SceneFile make(const std::vector<std::string>& sets) {
    const std::string path = (m_folder / "ball.vdb").string();
    volume::writeVdb(path, {ballGrid("density", Vec3d(0.0), 0.1)});
    return parseScene(ballScene(path, Vec3d(0), 1), "t.toml", m_folder.path(), sets);
  }
  static double mean(const std::vector<Rgb>& pixels) {
    double sum = 0;
    for (const Rgb& p : pixels)
      sum += static_cast<double>(meanComponent(p)) / static_cast<double>(pixels.size());
    return sum;
  }

  TemporaryFolder m_folder;
};

TEST_F(GatherScene, GathersFromAHistogramOrHarmonics) {
  const FrameResult plain = renderScene(make({}), 1);
  const double reference = mean(plain.layers.multiple);
  for (const char* basis : {"auto", "histogram", "spherical_harmonics"}) {
    const FrameResult r = renderScene(
        make({"estimator.final_gather=24", fmt::format("estimator.basis={}", basis)}), 1);
    EXPECT_NEAR(mean(r.layers.multiple), reference, 0.05 * reference) << basis;
    EXPECT_TRUE(contains(r.layout, "per_step")) << r.layout;
    EXPECT_NEAR(mean(r.layers.single), mean(plain.layers.single), 1e-6);
    EXPECT_EQ(r.layers.negativeSamples + r.layers.nanSamples, 0u);
    // Light found by rays carries their noise; light looked up along the ray does not.
    EXPECT_NE(r.layers.multiple, plain.layers.multiple);
  }
}

TEST_F(GatherScene, HarmonicsAreNamedAndCached) {
  const SceneFile s = make({"estimator.basis=spherical_harmonics", "estimator.order=3"});
  const FrameResult direct = renderScene(s, 1);
  EXPECT_TRUE(contains(direct.layout, "16 spherical harmonics (order 3)")) << direct.layout;
  const std::string cache = (m_folder / "light.vdb").string();
  traceScene(s, 1, cache);
  const FrameResult cached = renderScene(make({fmt::format("estimator.cache={}", cache)}), 1);
  EXPECT_TRUE(contains(cached.layout, "order 3")) << cached.layout;
  EXPECT_EQ(cached.layers.multiple, direct.layers.multiple);
  // A lobe as sharp as this one rings at a low order: the light below zero is said.
  const FrameResult sharp = renderScene(
      make({"estimator.basis=spherical_harmonics", "estimator.order=2", "volume.0.phase.g=0.9"}),
      1);
  EXPECT_GT(sharp.statistics.negativeLight, 0.001);
  EXPECT_TRUE(std::any_of(sharp.notes.begin(), sharp.notes.end(),
                          [](const std::string& note) { return contains(note, "below zero"); }));
}

TEST_F(GatherScene, RefusesWhatCannotBeLookedUp) {
  const auto says = [&](std::vector<std::string> sets) {
    sets.push_back("estimator.final_gather=4");
    return complaint([&] { make(sets); });
  };
  EXPECT_TRUE(contains(says({"estimator.basis=view"}), "toward every direction"));
  EXPECT_TRUE(contains(says({"estimator.evaluate=per_view"}), "per_step"));
  EXPECT_TRUE(contains(says({"estimator.type=path_traced"}), "needs type"));
  EXPECT_EQ(says({"estimator.carrier=particles"}), "");
  EXPECT_TRUE(contains(complaint([&] { make({"estimator.order=9"}); }), "at most 8"));
  EXPECT_TRUE(contains(complaint([&] {
                         make({"estimator.basis=spherical_harmonics", "estimator.merge=sampled",
                               "estimator.carrier=particles"});
                       }),
                       "'merge'"));
}

}  // namespace
}  // namespace photosphere::test
