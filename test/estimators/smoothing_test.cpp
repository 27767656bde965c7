// The ways to smooth fluence on voxels (METHOD.md section 5.3) against path tracing.

#include <gtest/gtest.h>

#include <map>

#include "photosphere/core/error.h"
#include "photosphere/estimators/layout_names.h"
#include "support/frames.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

using namespace estimators;

// A kernel of four light voxels over a ball that is lit from one side, where the ways differ most.
TEST(FluenceSmoothing, DensityGainsWhatPlainLosesAndTheOthersAreBetween) {
  if (kSanitized) GTEST_SKIP() << "a mean of many paths, too slow under a sanitizer";
  const TestScene scene = sphereScene(8, 0.95, 0.5, 32, 48);
  const Truth truth = pathTruth(scene, 256);
  std::map<Smoothing, LayerError> errors;
  for (const Named<Smoothing>& way : Names<Smoothing>::all) {
    LightFieldLayout layout;
    layout.channels = 1;
    layout.smoothing = way.value;
    layout.radius = 4 * layout.lightVoxel * scene.medium->voxelEdge();
    const PhotosphereFrame frame = renderPhotosphere(scene, layout, 400'000, 5);
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

// A voxel's mean says little of light that enters and leaves within a hundredth of it.
TEST(FluenceSmoothing, WhatTheEyeSeesOfOpaqueVoxelsIsKept) {
  if (kSanitized) GTEST_SKIP() << "a mean of many paths, too slow under a sanitizer";
  for (const double depth : {60.0, 3000.0}) {
    const TestScene scene = sphereScene(depth, 0.95, 0.0, 16, 32);
    const Truth truth = pathTruth(scene, 100);
    std::map<Smoothing, double> ratio;
    for (const Smoothing way : {Smoothing::twicing, Smoothing::visible}) {
      LightFieldLayout layout;
      layout.channels = 1;
      layout.smoothing = way;
      layout.radius = 0.5 * layout.lightVoxel * scene.medium->voxelEdge();
      const PhotosphereFrame frame = renderPhotosphere(scene, layout, 200'000, 5);
      const LayerError e = truth.errorOf(frame.layers, &render::FrameLayers::multiple);
      std::printf("  %g %-8s mean %.4f  relMSE %.5f\n", depth, std::string(nameOf(way)).c_str(),
                  e.meanRatio, e.relMse);
      ratio[way] = e.meanRatio;
    }
    EXPECT_LT(ratio[Smoothing::twicing], 0.9) << depth;
    EXPECT_NEAR(ratio[Smoothing::visible], 1.0, 0.08) << depth;
  }
}

// Collisions are weighed as track lengths are.
TEST(FluenceSmoothing, WhatTheEyeSeesOfCollisionsIsKept) {
  if (kSanitized) GTEST_SKIP() << "a mean of many paths, too slow under a sanitizer";
  const TestScene scene = sphereScene(60, 0.95, 0.0, 16, 32);
  const Truth truth = pathTruth(scene, 100);
  LightFieldLayout layout;
  layout.channels = 1;
  layout.deposit = Deposit::collision;
  layout.smoothing = Smoothing::visible;
  layout.radius = 0.5 * layout.lightVoxel * scene.medium->voxelEdge();
  const PhotosphereFrame frame = renderPhotosphere(scene, layout, 200'000, 5);
  EXPECT_NEAR(truth.errorOf(frame.layers, &render::FrameLayers::multiple).meanRatio, 1.0, 0.08);
}

TEST(FluenceSmoothing, WhatTheEyeSeesNeedsAnEye) {
  LightFieldLayout layout;
  layout.smoothing = Smoothing::visible;
  EXPECT_NO_THROW(checkLayout(layout));
  for (const Basis basis : {Basis::histogram, Basis::sphericalHarmonics}) {
    layout.basis = basis;
    EXPECT_THROW(checkLayout(layout), ConfigError);
  }
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
