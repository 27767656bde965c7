// Smoke whose extinction is coloured, smoke that moves and smoke that overlaps, in every estimator
// against path tracing.

#include <gtest/gtest.h>

#include "support/frames.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

using namespace estimators;
using transport::Medium;
using transport::MediumVolume;

MediumVolume plume(double extinction, double albedo = 0.9, double g = 0.5) {
  return sampledVolume(1.0, 64, {albedo, g, extinction}, plumeDensity);
}

TestScene sceneOf(std::vector<MediumVolume> volumes, const transport::Shutter& shutter = {}) {
  TestScene scene = plumeScene(plume(1.0), 48);
  scene.medium = std::make_unique<Medium>(std::move(volumes), shutter);
  return scene;
}

TestScene sceneOf(MediumVolume volume, const transport::Shutter& shutter = {}) {
  std::vector<MediumVolume> volumes;
  volumes.push_back(std::move(volume));
  return sceneOf(std::move(volumes), shutter);
}

// Frames of all estimators held against the truth. @param mean, relMse  of the photosphere
void expectAgreement(const std::string& name, const TestScene& scene, int channels, double mean,
                     double relMse) {
  const Truth truth = pathTruth(scene, 128);
  const auto check = [&](const char* way, const render::FrameLayers& frame, double slack) {
    EXPECT_EQ(frame.nanSamples + frame.negativeSamples, 0u) << name << ", " << way;
    EXPECT_EQ(frame.counters.tracking.majorantViolations, 0u) << name << ", " << way;
    const LayerError single = truth.errorOf(frame, &render::FrameLayers::single);
    const LayerError multiple = truth.errorOf(frame, &render::FrameLayers::multiple);
    const LayerError through = truth.errorOf(frame, &render::FrameLayers::transmittance);
    std::printf("  %-18s %-14s single %.4f  multiple %.4f, relMSE %.5f  transmittance %.4f\n",
                name.c_str(), way, single.meanRatio, multiple.meanRatio, multiple.relMse,
                through.meanRatio);
    EXPECT_NEAR(single.meanRatio, 1.0, 0.015) << name << ", " << way;
    EXPECT_NEAR(multiple.meanRatio, 1.0, slack * mean) << name << ", " << way;
    EXPECT_LT(multiple.relMse, slack * relMse) << name << ", " << way;
    EXPECT_NEAR(through.meanRatio, 1.0, 0.005) << name << ", " << way;
  };
  LightFieldLayout layout;
  layout.channels = channels;
  check("view", renderPhotosphere(scene, layout, 300'000, 5).layers, 1);
  layout.basis = Basis::histogram;
  layout.rows = 4;
  check("128 bins", renderPhotosphere(scene, layout, 150'000, 5).layers, 1.5);
  // Gathering asks toward any direction.
  layout.evaluate = Evaluate::perStep;
  check("final gathering", renderPhotosphere(scene, layout, 150'000, 5, 4, 16).layers, 2);
  PhotonMapLayout map;
  map.channels = channels;
  map.radius = 0.03;
  check("photon map", renderPhotonMap(scene, map, 150'000, 5).layers, 4);
}

TEST(ColouredSmoke, AgreesWithPathTracing) {
  const RunOnly runOnly;
  MediumVolume v = plume(40.0);
  v.tint = Rgb(0.15f, 0.5f, 1.0f);
  v.albedo = Rgb(0.95f, 0.9f, 0.8f);
  expectAgreement("coloured", sceneOf(std::move(v)), 3, 0.02, 0.02);
}

TEST(ColouredSmoke, OfTwoColoursAgreesWithPathTracing) {
  const RunOnly runOnly;
  std::vector<MediumVolume> volumes;
  volumes.push_back(plume(30.0));
  volumes.back().tint = Rgb(0.15f, 0.5f, 1.0f);
  volumes.push_back(sampledVolume(1.0, 64, {0.95, -0.2, 12.0}, [](const Vec3d& p) {
    return plumeDensity(Vec3d(p.y, -p.x, p.z));
  }));
  volumes.back().tint = Rgb(1.0f, 0.4f, 0.2f);
  expectAgreement("two colours", sceneOf(std::move(volumes)), 3, 0.025, 0.025);
}

// In surroundings of 1, smoke of albedo 1 is seen as nothing in every channel.
TEST(ColouredSmoke, WhiteFurnaceIsOneInEveryChannel) {
  MediumVolume v =
      sampledVolume(1.0, 48, {.albedo = 1.0, .g = 0.4, .extinction = 20.0}, plumeDensity);
  v.tint = Rgb(0.15f, 0.5f, 1.0f);
  TestScene scene = sceneOf(std::move(v));
  scene.lights.clear();
  scene.lights.push_back(makeLight("environment", {}));
  LightFieldLayout layout;
  layout.channels = 3;
  layout.unscattered = true;
  const PhotosphereFrame frame =
      renderPhotosphere(scene, layout, kSanitized ? 20'000 : 2'000'000, 5);
  EXPECT_EQ(frame.layers.nanSamples + frame.layers.negativeSamples, 0u);
  if (kSanitized) return;
  for (int c = 0; c < 3; ++c) {
    std::vector<Rgb> channel;
    for (const Rgb& pixel : frame.layers.beauty)
      channel.emplace_back(pixel[c]);
    const BlockDeviation off = deviationFromOne(channel, 48, 8);
    std::printf("  channel %d: mean %.5f, worst block off by %.4f\n", c, off.mean, off.worst);
    EXPECT_NEAR(off.mean, 1.0, 0.005) << "channel " << c;
    EXPECT_LT(off.worst, 0.04) << "channel " << c;
  }
}

TEST(MovingSmoke, AgreesWithPathTracing) {
  const RunOnly runOnly;
  // Eight voxels while the shutter is open, and a turn.
  const auto velocity = [](const Vec3d& p) { return Vec3d(2.5 - 2 * p.y, 2 * p.x, 0.5); };
  MediumVolume v = plume(30.0);
  v.motion = sampledMotion(2.0, 64, velocity);
  expectAgreement("moving", sceneOf(std::move(v), {-0.025, 0.025}), 1, 0.02, 0.05);
}

TEST(MovingSmoke, WithFireAgreesWithPathTracing) {
  const RunOnly runOnly;
  const auto velocity = [](const Vec3d&) { return Vec3d(2.0, 0.0, 1.0); };
  MediumVolume v = plume(30.0);
  v.motion = sampledMotion(2.0, 64, velocity);
  v.emission = sampledEmission(1.0, 64, [](const Vec3d& p) {
    const Vec3d a = p - Vec3d(0.02, 0.0, -0.2);
    return Rgb(Vec3d(60.0 * std::exp(-80 * glm::dot(a, a))));
  });
  const TestScene scene = sceneOf(std::move(v), {-0.025, 0.025});
  const Truth truth = pathTruth(scene, 128);
  LightFieldLayout layout;
  layout.channels = 1;
  const PhotosphereFrame frame = renderPhotosphere(scene, layout, 300'000, 5);
  const LayerError emission = truth.errorOf(frame.layers, &render::FrameLayers::emission);
  const LayerError multiple = truth.errorOf(frame.layers, &render::FrameLayers::multiple);
  std::printf("  emission %.4f, %.5f  multiple %.4f, %.5f\n", emission.meanRatio, emission.relMse,
              multiple.meanRatio, multiple.relMse);
  EXPECT_NEAR(emission.meanRatio, 1.0, 0.005);
  EXPECT_LT(emission.relMse, 0.01);
  EXPECT_NEAR(multiple.meanRatio, 1.0, 0.02);
  EXPECT_LT(multiple.relMse, 0.03);
}

// Two volumes of half the density, one with each phase function, are one volume that mixes both.
TEST(OverlappingSmoke, OfHalfDensityIsOne) {
  const RunOnly runOnly;
  const phase::Draine forward(0.7), back(-0.3);
  MediumVolume whole = plume(30.0);
  whole.phase = phase::PhaseFunction(forward, back, 0.5);
  const TestScene one = sceneOf(std::move(whole));
  std::vector<MediumVolume> halves;
  halves.push_back(plume(15.0));
  halves.back().phase = phase::PhaseFunction(forward);
  halves.push_back(plume(15.0));
  halves.back().phase = phase::PhaseFunction(back);
  const TestScene two = sceneOf(std::move(halves));
  ASSERT_EQ(two.medium->phases().size(), 2u);
  const Truth a = pathTruth(one, 128);
  const LayerError paths = a.errorOf(renderPath(two, 256, 77), &render::FrameLayers::beauty);
  EXPECT_NEAR(paths.meanRatio, 1.0, 0.01);
  LightFieldLayout layout;
  layout.channels = 1;
  const render::FrameLayers x = renderPhotosphere(one, layout, 300'000, 5).layers;
  const render::FrameLayers y = renderPhotosphere(two, layout, 300'000, 5).layers;
  double difference = 0, sum = 0;
  for (std::size_t i = 0; i < x.single.size(); ++i) {
    difference = std::max(difference,
                          static_cast<double>(maxComponent(glm::abs(x.single[i] - y.single[i]))));
    sum = std::max(sum, static_cast<double>(maxComponent(x.single[i])));
  }
  EXPECT_LT(difference, 1e-4 * sum) << "single scattering has no noise to hide behind";
  EXPECT_NEAR(a.errorOf(y, &render::FrameLayers::multiple).meanRatio, 1.0, 0.03);

  // Albedos mix as well: 0.9 in each half or 1 and 0.8.
  std::vector<MediumVolume> unequal;
  unequal.push_back(plume(15.0, 1.0));
  unequal.push_back(plume(15.0, 0.8));
  const Truth mixed = pathTruth(sceneOf(std::move(unequal)), 128);
  const LayerError same =
      mixed.errorOf(renderPath(sceneOf(plume(30.0, 0.9)), 256, 78), &render::FrameLayers::beauty);
  EXPECT_NEAR(same.meanRatio, 1.0, 0.01);
}

}  // namespace
}  // namespace photosphere::test
