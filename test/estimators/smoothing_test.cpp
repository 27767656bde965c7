// The ways to smooth fluence on voxels (METHOD.md section 5.3) against path tracing.

#include <gtest/gtest.h>

#include <map>

#include "photosphere/core/error.h"
#include "photosphere/estimators/layout_names.h"
#include "support/frames.h"
#include "support/media.h"
#include "support/support.h"
#include "voxel_smoothing.h"

namespace photosphere::test {
namespace {

using namespace estimators;

// A kernel of four light voxels over a ball that is lit from one side, where the ways differ most.
TEST(FluenceSmoothing, DensityGainsWhatPlainLosesAndTheOthersAreBetween) {
  const RunOnly runOnly;
  const TestScene scene = sphereScene(8, 0.95, 0.5, 32, 48);
  const Truth truth = pathTruth(scene, 128);
  std::map<Smoothing, LayerError> errors;
  for (const Named<Smoothing>& way : Names<Smoothing>::all) {
    LightFieldLayout layout;
    layout.channels = 1;
    layout.smoothing = way.value;
    layout.radius = 4 * layout.lightVoxel * scene.medium->voxelEdge();
    const PhotosphereFrame frame = renderPhotosphere(scene, layout, 200'000, 5);
    const LayerError e = truth.errorOf(frame.layers, &render::FrameLayers::multiple);
    std::printf("  %-8s mean %.4f  relMSE %.5f\n", std::string(way.name).c_str(), e.meanRatio,
                e.relMse);
    errors[way.value] = e;
  }
  EXPECT_LT(errors[Smoothing::plain].meanRatio, 0.99);
  EXPECT_GT(errors[Smoothing::density].meanRatio, 1.01);
  EXPECT_NEAR(errors[Smoothing::mean].meanRatio,
              0.5 * (errors[Smoothing::plain].meanRatio + errors[Smoothing::density].meanRatio),
              0.002);
  for (const Smoothing way : {Smoothing::plain, Smoothing::density, Smoothing::mean})
    EXPECT_LT(errors[Smoothing::twicing].relMse, errors[way].relMse);
}

// A few voxels with light, as few photons leave them: what sharpening takes from their neighbours
// is what it gives to them.
TEST(FluenceSmoothing, SharpeningMakesNoLightOfNoise) {
  const transport::Medium medium =
      makeMedium(sampledVolume(1.0, 32, {}, [](const Vec3d&) { return 1.0; }));
  const transport::SupportLattice lattice(medium, medium.voxelEdge(), 1);
  for (const double radius : {0.0, 2.5}) {
    Colours colours(lattice.size(), Vec4f(0.0f));
    Rng rng(RandomKey::fromSeed(7, 0), RandomStream::test, 0);
    double before = 0;
    for (std::size_t i = 0; i < colours.size(); ++i) {
      if (rng.uniform() > 0.02f) continue;
      const Vec3f p = lattice.center(i);
      // Where all neighbours of neighbours are.
      if (glm::max(std::abs(p.x), std::max(std::abs(p.y), std::abs(p.z))) > 0.3f) continue;
      colours[i] = Vec4f(rng.uniform());
      before += static_cast<double>(colours[i].x);
    }
    ASSERT_GT(before, 10);
    const double edge = lattice.edge();
    const Colours sharp =
        sharpenedVoxels(lattice, colours, SpatialKernel::epanechnikov, radius * edge);
    const Smoothed smoothed =
        smoothVoxels(lattice, colours, SpatialKernel::epanechnikov, radius * edge);
    double after = 0, cut = 0;
    float brightest = 0;
    for (std::size_t i = 0; i < sharp.size(); ++i) {
      after += static_cast<double>(sharp[i].x);
      cut += std::max(0.0, static_cast<double>(2 * smoothed.once[i].x - smoothed.again[i].x));
      brightest = std::max(brightest, sharp[i].x / std::max(smoothed.once[i].x, 1e-6f));
    }
    EXPECT_NEAR(after / before, 1.0, 1e-4) << radius;
    EXPECT_GT(brightest, 1.05f) << radius;    // it does sharpen
    EXPECT_GT(cut / before, 1.05) << radius;  // where cutting off does make some
  }
}

// Frames of 20,000 photons in light voxels of half a density voxel have the mean of one of many.
void expectTheMeanOfMany(double g, Basis basis, int frames, std::uint64_t many, double bound) {
  const TestScene scene = sphereScene(2, 0.9, g, 32, 24);
  LightFieldLayout layout;
  layout.channels = 1;
  layout.basis = basis;
  layout.lightVoxel = 0.5;
  layout.radius = 1e-3;
  const auto meanOf = [&](std::uint64_t photons, std::uint64_t seed) {
    double sum = 0;
    for (const Rgb& pixel : renderPhotosphere(scene, layout, photons, seed).layers.multiple)
      sum += static_cast<double>(pixel.x);
    return sum;
  };
  if (kSanitized) {
    EXPECT_GT(meanOf(1000, 1), 0);
    return;
  }
  double few = 0;
  for (int i = 0; i < frames; ++i)
    few += meanOf(20'000, 100 + static_cast<std::uint64_t>(i)) / frames;
  const double ratio = few / meanOf(many, 5);
  std::printf("  few over many %.4f\n", ratio);
  EXPECT_NEAR(ratio, 1.0, bound);
}

TEST(FluenceSmoothing, FewPhotonsHaveTheMeanOfMany) {
  expectTheMeanOfMany(0.7, Basis::view, 32, 1'000'000, 0.03);
}

// A bin's light that is read beside a needle is below zero, and made up for by its neighbours'.
TEST(FluenceSmoothing, FewPhotonsInBinsHaveTheMeanOfMany) {
  expectTheMeanOfMany(0.95, Basis::histogram, 20, 700'000, 0.05);
}

std::vector<Vec3f> pointsInBall(int count) {
  Rng rng(RandomKey::fromSeed(9, 0), RandomStream::test, 0);
  std::vector<Vec3f> points;
  while (points.size() < static_cast<std::size_t>(count)) {
    const Vec3f p = Vec3f(rng.uniform(), rng.uniform(), rng.uniform()) - 0.5f;
    if (glm::length(p) < 0.5f) points.push_back(p);
  }
  return points;
}

class OpaqueVoxels : public ::testing::TestWithParam<double> {};

// A voxel's mean says little of light that enters and leaves within a hundredth of it.
TEST_P(OpaqueVoxels, KeepWhatIsSeenOfThem) {
  const RunOnly runOnly;
  TestScene scene = sphereScene(GetParam(), 0.95, 0.0, 16, 32);
  scene.particles = pointsInBall(20'000);
  const Truth truth = pathTruth(scene, 64);
  const auto meanOf = [&](LightFieldLayout layout, Smoothing way) {
    layout.channels = 1;
    layout.smoothing = way;
    layout.radius = 0.5 * layout.lightVoxel * scene.medium->voxelEdge();
    const PhotosphereFrame frame = renderPhotosphere(scene, layout, 40'000, 5);
    const LayerError e = truth.errorOf(frame.layers, &render::FrameLayers::multiple);
    std::printf(
        "  %s %s %s %-8s mean %.4f  relMSE %.5f\n", std::string(nameOf(layout.basis)).c_str(),
        std::string(nameOf(layout.carrier)).c_str(), std::string(nameOf(layout.evaluate)).c_str(),
        std::string(nameOf(way)).c_str(), e.meanRatio, e.relMse);
    return e.meanRatio;
  };
  LightFieldLayout view, bins, harmonics, steps, particles;
  bins.basis = steps.basis = particles.basis = Basis::histogram;
  harmonics.basis = Basis::sphericalHarmonics;
  steps.evaluate = Evaluate::perStep;
  particles.carrier = Carrier::particles;
  for (const LightFieldLayout& layout : {view, bins, harmonics, particles}) {
    EXPECT_LT(meanOf(layout, Smoothing::twicing), 0.9);
    EXPECT_NEAR(meanOf(layout, Smoothing::visible), 1.0, 0.08);
  }
  // Every step reads voxels that were divided by their weights one by one.
  EXPECT_NEAR(meanOf(steps, Smoothing::visible), 1.0, 0.15);
}

INSTANTIATE_TEST_SUITE_P(FluenceSmoothing, OpaqueVoxels, ::testing::Values(60.0, 3000.0));

// An eye that flies into thick smoke goes on seeing it: in a furnace, as bright as outside.
TEST(FluenceSmoothing, WhatAnEyeInsideSeesIsKept) {
  const RunOnly runOnly;
  TestScene scene;
  scene.medium = std::make_unique<transport::Medium>(
      makeMedium(sampledVolume(1.0, 16, {1.0, 0.0, 40.0},
                               [](const Vec3d& p) { return glm::length(p) < 0.45 ? 1.0 : 0.0; })));
  scene.lights.push_back(makeLight("environment", {{"color", "[1, 1, 1]"}}));
  LightFieldLayout layout;
  layout.channels = 1;
  layout.smoothing = Smoothing::visible;
  layout.radius = 0.5 * layout.lightVoxel * scene.medium->voxelEdge();
  for (const double z : {0.6, 0.45, 0.4, 0.35}) {
    scene.camera = perspectiveCamera({0.02, 0.01, z}, 40, 16);
    const PhotosphereFrame frame = renderPhotosphere(scene, layout, 400'000, 5);
    const BlockDeviation furnace = deviationFromOne(frame.layers.beauty, 16, 8);
    std::printf("  eye at %.2f: mean %.4f worst %.4f\n", z, furnace.mean, furnace.worst);
    EXPECT_NEAR(furnace.mean, 1.0, 0.15) << z;
    EXPECT_LT(furnace.worst, 0.2) << z;
  }
}

// Collisions are weighed as track lengths are.
TEST(FluenceSmoothing, WhatTheEyeSeesOfCollisionsIsKept) {
  const RunOnly runOnly;
  const TestScene scene = sphereScene(60, 0.95, 0.0, 16, 32);
  const Truth truth = pathTruth(scene, 100);
  LightFieldLayout layout;
  layout.channels = 1;
  layout.deposit = Deposit::collision;
  layout.smoothing = Smoothing::visible;
  layout.radius = 0.5 * layout.lightVoxel * scene.medium->voxelEdge();
  const PhotosphereFrame frame = renderPhotosphere(scene, layout, 100'000, 5);
  EXPECT_NEAR(truth.errorOf(frame.layers, &render::FrameLayers::multiple).meanRatio, 1.0, 0.08);
}

TEST(FluenceSmoothing, WhatIsSeenIsOfFluenceOnVoxels) {
  LightFieldLayout layout;
  layout.smoothing = Smoothing::visible;
  for (const Basis basis : {Basis::view, Basis::histogram, Basis::sphericalHarmonics}) {
    layout.basis = basis;
    EXPECT_NO_THROW(checkLayout(layout));
  }
  layout.carrier = Carrier::particles;
  EXPECT_NO_THROW(checkLayout(layout));
  layout.deposit = Deposit::collision;
  EXPECT_THROW(checkLayout(layout), ConfigError);
}

TEST(FluenceSmoothing, IsOfVoxelsResolvedPerView) {
  for (const bool particles : {false, true}) {
    LightFieldLayout layout;
    layout.basis = Basis::histogram;
    layout.smoothing = Smoothing::mean;
    layout.carrier = particles ? Carrier::particles : Carrier::voxels;
    layout.evaluate = particles ? Evaluate::perView : Evaluate::perStep;
    EXPECT_THROW(checkLayout(layout), ConfigError);
    layout.smoothing = Smoothing::twicing;
    EXPECT_NO_THROW(checkLayout(layout));
  }
}

}  // namespace
}  // namespace photosphere::test
