// Smoke that glows: the photosphere against path tracing and the thermal furnace.

#include <gtest/gtest.h>

#include <cmath>

#include "photosphere/core/parallel.h"
#include "support/frames.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using estimators::Basis;
using estimators::Carrier;
using estimators::LightFieldLayout;

constexpr int kPixels = 64;
constexpr std::uint64_t kPhotons = kSanitized ? 5'000 : 250'000;

struct CarrierCase {
  Carrier carrier;
  Basis basis;
};
std::ostream& operator<<(std::ostream& out, const CarrierCase& c) {
  return out << (c.carrier == Carrier::voxels ? "voxels" : "particles")
             << (c.basis == Basis::view ? "_view" : "_histogram");
}

class Glow : public testing::TestWithParam<CarrierCase> {
 protected:
  static LightFieldLayout layout(int channels) {
    LightFieldLayout l;
    l.carrier = GetParam().carrier;
    l.basis = GetParam().basis;
    l.channels = channels;
    return l;
  }
};

// The plume with a fire of two colours at its foot, partly outside the smoke, and the lamp.
TestScene burningPlume(double g) {
  transport::MediumVolume v = sampledVolume(1.0, 64, {0.9, g, 30.0}, plumeDensity);
  v.emission = sampledEmission(1.0, 64, [](const Vec3d& p) {
    const Vec3d a = p - Vec3d(0.02, 0.0, -0.3), b = p - Vec3d(-0.12, -0.05, -0.15);
    const double first = std::exp(-80 * glm::dot(a, a)), second = std::exp(-120 * glm::dot(b, b));
    return Rgb(Vec3d(90, 40, 10) * first + Vec3d(10, 20, 60) * second);
  });
  TestScene scene = plumeScene(std::move(v), kPixels);
  scene.particles = seedParticles(*scene.medium, 60'000);
  return scene;
}

TEST_P(Glow, AgreesWithPathTracing) {
  const TestScene scene = burningPlume(0.6);
  static const Truth truth = pathTruth(scene, kSanitized ? 2 : 64);
  const PhotosphereFrame frame = renderPhotosphere(scene, layout(3), kPhotons, 5);
  EXPECT_EQ(frame.layers.nanSamples + frame.layers.negativeSamples, 0u);
  EXPECT_GT(frame.statistics.born, frame.statistics.photons / 10);
  if (kSanitized) return;  // too few paths to judge by
  const LayerError total = truth.errorOf(frame.layers, &render::FrameLayers::beauty);
  const LayerError multiple = truth.errorOf(frame.layers, &render::FrameLayers::multiple);
  const LayerError emission = truth.errorOf(frame.layers, &render::FrameLayers::emission);
  std::printf("  total: mean ratio %.4f, relMSE %.5f; multiple: %.4f, %.5f; emission: %.4f, %.5f\n",
              total.meanRatio, total.relMse, multiple.meanRatio, multiple.relMse,
              emission.meanRatio, emission.relMse);
  const bool voxels = GetParam().carrier == Carrier::voxels;
  EXPECT_NEAR(total.meanRatio, 1.0, 0.015);
  EXPECT_NEAR(multiple.meanRatio, 1.0, voxels ? 0.015 : 0.03);
  EXPECT_NEAR(emission.meanRatio, 1.0, 0.005);
  EXPECT_LT(total.relMse, 0.02);
  EXPECT_LT(multiple.relMse, voxels ? 0.02 : 0.03);
  EXPECT_LT(emission.relMse, 0.002);
}

// Emission sigma_a in surroundings of 1: every pixel is 1, though part of it was absorbed and
// given off again on the way.
TEST_P(Glow, ThermalFurnaceIsOneEverywhere) {
  for (const double albedo : {0.5, 0.8}) {
    transport::MediumVolume v = sampledVolume(1.0, 48, {albedo, 0.6, 15.0}, plumeDensity);
    v.emission = sampledEmission(1.0, 48, [&](const Vec3d& p) {
      return Rgb(static_cast<float>(15.0 * (1 - albedo) * plumeDensity(p)));
    });
    TestScene scene;
    scene.medium = std::make_unique<transport::Medium>(makeMedium(std::move(v)));
    scene.lights.push_back(makeLight("environment", {}));
    scene.camera = perspectiveCamera({0, -3, 0.4}, 22, kPixels);
    scene.particles = seedParticles(*scene.medium, 60'000);
    LightFieldLayout l = layout(1);
    l.unscattered = true;
    const PhotosphereFrame frame = renderPhotosphere(scene, l, 2 * kPhotons, 5);
    const BlockDeviation off = deviationFromOne(frame.layers.beauty, kPixels, 8);
    std::printf("  albedo %.1f: mean %.5f, worst block off by %.4f\n", albedo, off.mean, off.worst);
    if (kSanitized) continue;
    EXPECT_NEAR(off.mean, 1.0, 0.005);
    EXPECT_LT(off.worst, 0.03);
  }
}

INSTANTIATE_TEST_SUITE_P(Carriers, Glow,
                         testing::Values(CarrierCase{Carrier::voxels, Basis::view},
                                         CarrierCase{Carrier::voxels, Basis::histogram},
                                         CarrierCase{Carrier::particles, Basis::histogram}),
                         testing::PrintToStringParamName());

TEST(GlowSum, DoesNotDependOnThreads) {
  const TestScene scene = burningPlume(0.3);
  LightFieldLayout l;
  l.basis = Basis::histogram;
  const auto values = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    transport::TraceOptions options;
    options.photons = 20'000;
    options.key = RandomKey::fromSeed(3, 0);
    transport::TraceStatistics statistics;
    l.radius = 0.03;
    return estimators::traceLightField(*scene.medium, scene.lights, l, scene.view(), {}, options,
                                       statistics)
        .values;
  };
  EXPECT_EQ(values(1), values(4));
}

}  // namespace

}  // namespace photosphere::test
