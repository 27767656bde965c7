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
