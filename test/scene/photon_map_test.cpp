// Photon maps through the scene file: passes, limits, memory, what is reported.

#include <cmath>

#include "fixture.h"
#include "photosphere/core/parallel.h"

namespace photosphere::test {
namespace {

using namespace scene;

constexpr bool kSlow = kSanitized;

class PhotonMapScene : public ::testing::Test {
 protected:
  void SetUp() override {
    m_file = (m_folder / "ball.vdb").string();
    volume::writeVdb(m_file, {ballGrid("density", Vec3d(0.0), 0.1)});
  }
  SceneFile scene(std::vector<std::string> sets = {}, const std::string& more = {}) {
    sets.insert(sets.begin(), "estimator.type=photon_map");
    return parseScene(ballScene(m_file, Vec3d(0.0), 1.0, more), "test.toml", m_folder.path(), sets);
  }
  FrameResult render(const std::vector<std::string>& sets, const std::string& more = {}) {
    return renderScene(scene(sets, more), 1);
  }

  TemporaryFolder m_folder;
  std::string m_file;
};

double sumOf(const std::vector<Rgb>& pixels) {
  double sum = 0;
  for (const Rgb& p : pixels)
    sum += static_cast<double>(p.y);
  return sum;
}

// Norm of the difference over the norm of the reference.
double relativeL2(const std::vector<Rgb>& image, const std::vector<Rgb>& reference) {
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < image.size(); ++i) {
    difference += std::pow(static_cast<double>(image[i].y - reference[i].y), 2);
    norm += std::pow(static_cast<double>(reference[i].y), 2);
  }
  return std::sqrt(difference / norm);
}

TEST_F(PhotonMapScene, AgreesWithThePhotosphere) {
  const FrameResult map = render({"estimator.photons=60000"});
  const FrameResult sphere = render({"estimator.type=photosphere", "estimator.photons=60000"});
  EXPECT_TRUE(sameBits(map.layers.single, sphere.layers.single));
  if (!kSlow) {
    EXPECT_NEAR(sumOf(map.layers.multiple) / sumOf(sphere.layers.multiple), 1.0, 0.04);
    EXPECT_LT(relativeL2(map.layers.multiple, sphere.layers.multiple), 0.2);
  }
  EXPECT_EQ(map.estimator, "photon_map");
  EXPECT_EQ(map.layout, "photon map, 1 channel, all in reach");
  EXPECT_GT(map.radius, 0.0);
  const FrameStatistics& s = map.statistics;
  EXPECT_EQ(s.photonsEmitted, 60000u);
  EXPECT_GT(s.photonsStored, 10000u);
  EXPECT_LT(s.photonsStored, s.photonsScattered);  // those that leave are not stored
  EXPECT_GT(s.lightMemoryBytes, 28 * s.photonsStored);
  EXPECT_NEAR(s.energyError.x, 0.0, 1e-6 * s.energyEmitted.x);
  EXPECT_TRUE(
      contains(statsJson(s), fmt::format("\"light_memory_bytes\": {}", s.lightMemoryBytes)));
  EXPECT_GT(sphere.statistics.lightMemoryBytes, 0u);
}

// As many photons, in passes of shrinking radius: the wide radius' error goes.
TEST_F(PhotonMapScene, PassesConvergeWhereAFixedRadiusDoesNot) {
  const int photons = kSlow ? 500 : 8'000;
  const auto estimate = [&](int passes, int each) {
    return render({"estimator.radius=0.5", fmt::format("estimator.passes={}", passes),
                   fmt::format("estimator.photons={}", each)});
  };
  const FrameResult fixed = estimate(1, 8 * photons), passes = estimate(8, photons);
  const FrameStatistics &a = fixed.statistics, &b = passes.statistics;
  EXPECT_EQ(a.photonsEmitted, b.photonsEmitted);
  EXPECT_EQ(a.photonsStored, b.photonsStored);
  EXPECT_NEAR(a.energyEmitted.x, b.energyEmitted.x, 1e-9 * a.energyEmitted.x);
  EXPECT_NEAR(a.energyAbsorbed.x, b.energyAbsorbed.x, 1e-9 * a.energyAbsorbed.x);
  EXPECT_LT(b.lightMemoryBytes, a.lightMemoryBytes / 4);
  EXPECT_EQ(passes.radius, fixed.radius);
  EXPECT_TRUE(contains(passes.layout, "8 passes"));
  if (kSlow) return;
  const FrameResult truth = render({"estimator.type=path_traced", "estimator.samples=1024"});
  const double wide = relativeL2(fixed.layers.multiple, truth.layers.multiple);
  const double progressive = relativeL2(passes.layers.multiple, truth.layers.multiple);
  std::printf("  fixed %.4f, progressive %.4f\n", wide, progressive);
  // The error of a wide ball comes from the smoke's edge and is about in proportion to the radius.
  double meanFactor = 0;
  for (int pass = 0; pass < 8; ++pass)
    meanFactor += estimators::progressiveRadiusFactor(pass) / 8;
  EXPECT_GT(wide, 0.15);
  EXPECT_LT(progressive, 0.93 * wide);
  EXPECT_NEAR(progressive / wide, meanFactor, 0.05);
}

TEST_F(PhotonMapScene, ThreadsDoNotChangeOneBit) {
  const std::vector<std::string> ways[] = {
      {"estimator.photons=3000", "estimator.passes=3"},
      {"estimator.photons=3000", "estimator.neighbors=20", "volume.0.albedo=[0.9, 0.5, 0.2]"},
      {"estimator.photons=3000", "estimator.kernel=gaussian", "estimator.spatial_kernel=gaussian"}};
  for (const auto& sets : ways) {
    const auto with = [&](unsigned threads) {
      const ThreadLimit limit(threads);
      return render(sets).layers.beauty;
    };
    EXPECT_TRUE(sameBits(with(1), with(3))) << sets[1];
  }
}

TEST_F(PhotonMapScene, LightOfTheSurroundingsIsSplitAsElsewhere) {
  const std::string sky = "[[light]]\ntype = \"environment\"\nintensity = 0.5\n";
  const int photons = kSlow ? 1000 : 60'000;
  const std::string count = fmt::format("estimator.photons={}", photons);
  const FrameResult map = render({count}, sky);
  const FrameResult truth = render({"estimator.type=path_traced", "estimator.samples=128"}, sky);
  EXPECT_GT(sumOf(map.layers.background), 0.0);
  if (kSlow) return;
  // Where light comes in from all sides the edge is brightest, and a ball there is partly empty.
  EXPECT_NEAR(sumOf(map.layers.single) / sumOf(truth.layers.single), 1.0, 0.05);
  EXPECT_NEAR(sumOf(map.layers.multiple) / sumOf(truth.layers.multiple), 1.0, 0.03);
  EXPECT_NEAR(sumOf(map.layers.beauty) / sumOf(truth.layers.beauty), 1.0, 0.02);
}

TEST_F(PhotonMapScene, ThreeChannelsOfGreyLightAreOne) {
  const FrameResult grey = render({"estimator.photons=5000"});
  const FrameResult chromatic = render({"estimator.photons=5000", "effects.chromatic=on"});
  EXPECT_TRUE(contains(chromatic.layout, "3 channels"));
  EXPECT_EQ(grey.radius, chromatic.radius);
  EXPECT_LT(relativeL2(chromatic.layers.multiple, grey.layers.multiple), 1e-6);
}

TEST_F(PhotonMapScene, TheSmallerLimitOfTheNearestHolds) {
  const auto layout = [&](const std::vector<std::string>& sets) {
    return *setUpFrame(scene(sets), 1).photonMap;
  };
  EXPECT_EQ(layout({}).neighbors, 0u);
  EXPECT_EQ(layout({"estimator.neighbors=40"}).neighbors, 40u);
  EXPECT_EQ(layout({"estimator.max_photons=30"}).neighbors, 30u);
  EXPECT_EQ(layout({"estimator.neighbors=40", "estimator.max_photons=30"}).neighbors, 30u);
  EXPECT_EQ(layout({"estimator.neighbors=20", "estimator.max_photons=30"}).neighbors, 20u);
  // A radius of its own for the nearest, which should seldom act; otherwise the automatic one.
  EXPECT_NEAR(layout({"estimator.neighbors=40"}).radius, 0.8, 1e-6);
  EXPECT_EQ(layout({"estimator.max_photons=30"}).radius, layout({}).radius);
  EXPECT_NEAR(layout({"estimator.neighbors=40", "estimator.radius=0.25"}).radius, 0.25, 1e-12);
  // Eight times the photons, half the radius.
  EXPECT_NEAR(
      layout({"estimator.photons=20000"}).radius / layout({"estimator.photons=160000"}).radius, 2.0,
      0.02);
}

TEST_F(PhotonMapScene, TooManyPhotonsAreRefusedBeforeTheWork) {
  const std::string message = complaint(
      [&] {
        render({"estimator.photons=100000000000", "render.memory_limit=2"});
      },
      ExitCode::memory);
  EXPECT_TRUE(contains(message, "estimator.photons")) << message;
  EXPECT_TRUE(contains(message, "estimator.passes")) << message;
  const FrameSetup setup = setUpFrame(scene({"estimator.photons=1000000"}), 1);
  EXPECT_GT(predictedLightBytes(setup), 30u * setup.photonMapPhotons);
}

TEST_F(PhotonMapScene, NothingIsTracedForWhatIsOff) {
  const FrameResult r = render({"effects.multiple_scattering=off", "estimator.passes=5"});
  EXPECT_EQ(r.statistics.photonsEmitted, 0u);
  EXPECT_EQ(sumOf(r.layers.multiple), 0.0);
  EXPECT_GT(sumOf(r.layers.single), 0.0);
  EXPECT_EQ(r.layout, "");
}

TEST_F(PhotonMapScene, HasNoLightCache) {
  EXPECT_TRUE(
      contains(complaint([&] { scene({"estimator.cache=light.vdb"}); }), "'cache' needs type"));
  EXPECT_TRUE(
      contains(complaint([&] { traceScene(scene(), 1, (m_folder / "light.vdb").string()); }),
               "light cache"));
}

}  // namespace
}  // namespace photosphere::test
