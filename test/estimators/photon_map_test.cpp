// The photon map against path tracing, the furnace, and itself.

#include "photosphere/estimators/photon_map.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <map>

#include "photosphere/core/parallel.h"
#include "support/frames.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using estimators::PhotonMapLayout;
using sphere::AngularKernel;
using sphere::SmoothingKernel;

constexpr int kPixels = 48;
constexpr std::uint64_t kPhotons = kSanitized ? 3'000 : 300'000;

PhotonMapLayout greyLayout(double radius = 0.0, std::uint32_t neighbors = 0) {
  PhotonMapLayout layout;
  layout.channels = 1;
  layout.radius = radius;
  layout.neighbors = neighbors;
  return layout;
}

struct Judged {
  TestScene scene;
  Truth truth;
};

const Judged& judged(const std::string& name) {
  static std::map<std::string, Judged> cache;
  const auto found = cache.find(name);
  if (found != cache.end()) return found->second;
  Judged j;
  j.scene = name == "sphere" ? sphereScene(6, 0.9, 0.4, 32, kPixels) : plumeScene(0.7, 64, kPixels);
  j.truth = pathTruth(j.scene, kSanitized ? 2 : 256);
  return cache.emplace(name, std::move(j)).first->second;
}

LayerError multipleError(const Judged& j, const render::FrameLayers& layers) {
  const LayerError e = j.truth.errorOf(layers, &render::FrameLayers::multiple);
  std::printf("  mean ratio %.4f, relMSE %.5f (reference noise %.5f)\n", e.meanRatio, e.relMse,
              e.referenceNoise);
  return e;
}

class MapAgreement
    : public testing::TestWithParam<std::tuple<const char*, std::uint32_t, AngularKernel>> {};

TEST_P(MapAgreement, WithPathTracing) {
  const auto& [name, neighbors, kernel] = GetParam();
  const Judged& j = judged(name);
  PhotonMapLayout layout = greyLayout(neighbors > 0 ? 0.1 : 0.0, neighbors);
  if (kernel != AngularKernel::none) layout.directionKernel = SmoothingKernel(kernel, 0.1, 3.0);
  const PhotosphereFrame frame = renderPhotonMap(j.scene, layout, kPhotons, 5);
  EXPECT_EQ(frame.layers.nanSamples + frame.layers.negativeSamples, 0u);
  if (kSanitized) return;  // too few paths to judge by
  const LayerError e = multipleError(j, frame.layers);
  // A photon map blurs the source, and so lights the smoke's thin edge too much; the nearest, whose
  // ball grows there, even more so.
  EXPECT_NEAR(e.meanRatio, 1.0, neighbors > 0 ? 0.06 : 0.025);
  EXPECT_LT(e.relMse, 0.06);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, MapAgreement,
    testing::Combine(testing::Values("sphere", "plume"), testing::Values(0u, 30u),
                     testing::Values(AngularKernel::none, AngularKernel::gaussian)),
    [](const auto& row) {
      return std::string(std::get<0>(row.param)) +
             (std::get<1>(row.param) ? "_nearest" : "_radius") +
             (std::get<2>(row.param) == AngularKernel::none ? "" : "_smoothed");
    });

TEST(PhotonMapTest, ErrorFallsWithTheRadius) {
  const RunOnly runOnly;
  for (const char* name : {"sphere", "plume"}) {
    const Judged& j = judged(name);
    const LayerError wide =
        multipleError(j, renderPhotonMap(j.scene, greyLayout(0.12), 40'000, 5).layers);
    const LayerError narrow =
        multipleError(j, renderPhotonMap(j.scene, greyLayout(0.06), 40'000, 5).layers);
    EXPECT_GT(wide.relMse, 0.3) << name;
    EXPECT_LT(narrow.relMse, 0.35 * wide.relMse) << name;
  }
}

// Albedo 1 in surroundings of radiance 1: every pixel is 1.
TEST(PhotonMapTest, FurnaceIsOneEverywhere) {
  TestScene scene;
  scene.medium = std::make_unique<transport::Medium>(
      makeMedium(sampledVolume(1.0, 32, {1.0, 0.6, 15.0}, plumeDensity)));
  scene.lights.push_back(makeLight("environment", {}));
  scene.camera = perspectiveCamera({0, -3, 0.4}, 22, kPixels);
  PhotonMapLayout layout = greyLayout(0.02);
  layout.unscattered = true;
  const PhotosphereFrame frame = renderPhotonMap(scene, layout, kPhotons, 5);
  double sum = 0, single = 0;
  for (std::size_t i = 0; i < frame.layers.beauty.size(); ++i) {
    sum += static_cast<double>(frame.layers.beauty[i].y);
    single += static_cast<double>(frame.layers.single[i].y);
  }
  const double mean = sum / static_cast<double>(frame.layers.beauty.size());
  std::printf("  mean %.5f\n", mean);
  EXPECT_GT(single, 0.0);
  if (kSanitized) return;
  EXPECT_NEAR(mean, 1.0, 0.01);
}

// Counts what belongs in a map, by its own rule: collisions of light that was scattered before.
class Collisions final : public transport::FlightSink {
 public:
  void consume(std::span<const transport::Flight> flights) override {
    for (const transport::Flight& f : flights)
      if (f.collided() && f.scatterings > 0) ++count;
  }
  std::atomic<std::uint64_t> count{0};
};

TEST(PhotonMapTest, HoldsEveryCollisionAfterTheFirst) {
  const TestScene scene = sphereScene(6, 0.9, 0.3, 16, 8);
  transport::TraceOptions options;
  options.photons = 60'000;
  Collisions collisions;
  transport::tracePhotons(*scene.medium, scene.lights, options, collisions);
  transport::TraceStatistics statistics;
  const auto map =
      tracePhotonMap(*scene.medium, scene.lights, greyLayout(0.05), options, statistics);
  EXPECT_EQ(map->photons(), collisions.count);
  EXPECT_FALSE(map->carriesUnscattered());
  const auto forecast = estimators::forecastPhotons(*scene.medium, scene.lights, false, options);
  EXPECT_NEAR(static_cast<double>(forecast.photons) / static_cast<double>(map->photons()), 1.0,
              0.05);
  for (const std::uint32_t neighbors : {0u, 20u}) {
    const PhotonMapLayout layout = greyLayout(0.05, neighbors);
    const auto built = tracePhotonMap(*scene.medium, scene.lights, layout, options, statistics);
    EXPECT_GT(built->memoryBytes(), 28 * built->photons());
    EXPECT_LE(built->memoryBytes(), estimators::photonMapBytes(layout, built->photons()) + 4096);
  }
}

bool sameBits(const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Rgb)) == 0;
}

TEST(PhotonMapTest, ThreadsDoNotChangeOneBit) {
  const TestScene scene = sphereScene(8, 0.95, 0.5, 24, 24);
  for (const std::uint32_t neighbors : {0u, 25u}) {
    const auto render = [&](unsigned threads, std::uint64_t seed) {
      const ThreadLimit limit(threads);
      return renderPhotonMap(scene, greyLayout(0.05, neighbors), 20'000, seed).layers.beauty;
    };
    const auto one = render(1, 5);
    EXPECT_TRUE(sameBits(one, render(3, 5)));
    EXPECT_TRUE(sameBits(one, render(7, 5)));
    EXPECT_FALSE(sameBits(one, render(1, 6)));
  }
}

// Passes are parts of one trace: a map of each half holds half of the photons at their full power.
TEST(PhotonMapTest, PassesAreTheirOwnEstimates) {
  const TestScene scene = sphereScene(6, 0.9, 0.3, 16, 16);
  const auto source = [&](std::uint64_t first, std::uint64_t count) {
    transport::TraceOptions options;
    options.photons = 40'000;
    options.firstPhoton = first;
    options.photonCount = count;
    transport::TraceStatistics statistics;
    return tracePhotonMap(*scene.medium, scene.lights, greyLayout(0.2), options, statistics);
  };
  const auto whole = source(0, 40'000), early = source(0, 20'000), late = source(20'000, 20'000);
  EXPECT_EQ(whole->photons(), early->photons() + late->photons());
  for (const Vec3f& p : {Vec3f(0.0f), Vec3f(0.2f, -0.1f, 0.1f)}) {
    transport::Coefficients c;
    scene.medium->coefficients(p, c);
    const auto at = [&](const auto& map) {
      return static_cast<double>(map->at(p, {0, 1, 0}, c).multiple.x);
    };
    EXPECT_NEAR(0.5 * (at(early) + at(late)), at(whole), 1e-4 * at(whole));
    EXPECT_NE(at(early), at(late));
  }
}

TEST(PhotonMapTest, ProgressiveRadiiShrinkByVolume) {
  EXPECT_EQ(estimators::progressiveRadiusFactor(0), 1.0);
  for (int i = 1; i < 20; ++i) {
    const double ratio =
        estimators::progressiveRadiusFactor(i) / estimators::progressiveRadiusFactor(i - 1);
    EXPECT_NEAR(ratio * ratio * ratio, (i + 2.0 / 3.0) / (i + 1.0), 1e-12);
  }
  // The ball's volume falls as i^(a - 1).
  const double v = std::pow(estimators::progressiveRadiusFactor(9999), 3) /
                   std::pow(estimators::progressiveRadiusFactor(999), 3);
  EXPECT_NEAR(v, std::pow(10.0, -1.0 / 3.0), 1e-3);
}

// Smoothing each photon's direction wider than the lobe dims what is seen against the light and
// brightens what is seen along it, but moves light only: over all directions the sum stays.
TEST(PhotonMapTest, DirectionSmoothingKeepsTheSumOverDirections) {
  const TestScene scene = sphereScene(6, 0.9, 0.8, 16, 16);
  transport::TraceOptions options;
  options.photons = 20'000;
  transport::TraceStatistics statistics;
  PhotonMapLayout layout = greyLayout(0.15);
  const auto sharp = tracePhotonMap(*scene.medium, scene.lights, layout, options, statistics);
  for (const AngularKernel kernel : {AngularKernel::gaussian, AngularKernel::epanechnikov}) {
    layout.directionKernel = SmoothingKernel(kernel, 0.8, 3.0);
    const auto smooth = tracePhotonMap(*scene.medium, scene.lights, layout, options, statistics);
    const Vec3f p(0.1f, 0.05f, 0.1f);
    transport::Coefficients c;
    scene.medium->coefficients(p, c);
    double a = 0, b = 0, apart = 0;
    const int directions = 1500;
    for (int i = 0; i < directions; ++i) {
      // The Fibonacci spiral: even over the sphere.
      const double z = 1 - (2 * i + 1.0) / directions, phi = i * 2.399963229728653;
      const double s = std::sqrt(1 - z * z);
      const Vec3f wo(Vec3d(s * std::cos(phi), s * std::sin(phi), z));
      const auto x = static_cast<double>(sharp->at(p, wo, c).multiple.x);
      const auto y = static_cast<double>(smooth->at(p, wo, c).multiple.x);
      a += x;
      b += y;
      apart += std::abs(x - y);
    }
    EXPECT_NEAR(b / a, 1.0, 0.01);
    EXPECT_GT(apart / a, 0.05);
  }
}

}  // namespace

}  // namespace photosphere::test
