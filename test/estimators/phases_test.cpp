// Every phase function in every way to store light, against path tracing.

#include <gtest/gtest.h>

#include <cmath>

#include "photosphere/phase/phase.h"
#include "support/frames.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

using namespace estimators;
using phase::Draine;
using phase::PhaseFunction;

struct Row {
  const char* name;
  PhaseFunction phase;
  double noise = 1;  ///< a sharper peak needs more photons for the same noise
};
const Row kRows[] = {
    {"two lobes", PhaseFunction(Draine(0.7), Draine(-0.6), 0.4)},
    {"rayleigh", Draine(0.0, 1.0)},
    {"draine", Draine(0.4, 4.0)},
    {"as fog", PhaseFunction(Draine(0.8), Draine(0.5, 21.0), 0.48), 5},
};

void expectClose(const Row& row, const char* way, const LayerError& e, double mean, double relMse) {
  std::printf("  %-10s %-22s mean %.4f  relMSE %.5f\n", row.name, way, e.meanRatio, e.relMse);
  EXPECT_NEAR(e.meanRatio, 1.0, mean * std::sqrt(row.noise)) << row.name << ", " << way;
  EXPECT_LT(e.relMse, relMse * row.noise) << row.name << ", " << way;
}

TEST(Phases, AgreeWithPathTracing) {
  const RunOnly runOnly;
  for (const Row& row : kRows) {
    transport::MediumVolume smoke =
        sampledVolume(1.0, 64, {.albedo = 0.9, .extinction = 40.0}, plumeDensity);
    smoke.phase = row.phase;
    const TestScene scene = plumeScene(std::move(smoke), 48);
    const Truth truth = pathTruth(scene, 64);
    const auto error = [&](const render::FrameLayers& layers) {
      EXPECT_EQ(layers.nanSamples + layers.negativeSamples, 0u) << row.name;
      return truth.errorOf(layers, &render::FrameLayers::multiple);
    };
    LightFieldLayout layout;
    layout.channels = 1;
    expectClose(row, "view", error(renderPhotosphere(scene, layout, 200'000, 5).layers), 0.02,
                0.02);
    layout.basis = Basis::histogram;
    layout.rows = 4;
    expectClose(row, "128 bins", error(renderPhotosphere(scene, layout, 200'000, 5).layers), 0.03,
                0.03);
    layout.rows = 2;
    layout.representative = Representative::mean;
    expectClose(row, "32 mean directions",
                error(renderPhotosphere(scene, layout, 100'000, 5).layers), 0.15, 0.1);
    LightFieldLayout harmonics;
    harmonics.channels = 1;
    harmonics.basis = Basis::sphericalHarmonics;
    harmonics.order = 8;
    expectClose(row, "harmonics of order 8",
                error(renderPhotosphere(scene, harmonics, 100'000, 5).layers), 0.05, 0.05);
    PhotonMapLayout map;
    map.channels = 1;
    map.radius = 0.03;
    expectClose(row, "photon map", error(renderPhotonMap(scene, map, 100'000, 5).layers), 0.1, 0.1);
  }
}

// One photon that flies straight to the eye is as bright as thousands that do not, unless its
// direction is smoothed; what it gains is what others lose.
TEST(Phases, SmoothedDirectionsCalmANeedle) {
  const TestScene scene = plumeScene(0.95, 64, 48);
  struct Frames {
    double noise = 0, mean = 0;  // mean squared difference of two seeds over the squared mean; mean
  };
  const auto render = [&](sphere::AngularKernel kernel) {
    LightFieldLayout layout;
    layout.channels = 1;
    layout.angularKernel = kernel;
    layout.bandwidth = 0.3;
    const std::uint64_t photons = kSanitized ? 5'000 : 200'000;
    const std::vector<Rgb> a = renderPhotosphere(scene, layout, photons, 5).layers.multiple;
    const std::vector<Rgb> b = renderPhotosphere(scene, layout, photons, 6).layers.multiple;
    Frames frames;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double x = static_cast<double>(a[i].x), y = static_cast<double>(b[i].x);
      frames.noise += (x - y) * (x - y);
      frames.mean += 0.5 * (x + y);
    }
    frames.noise *= static_cast<double>(a.size()) / (frames.mean * frames.mean);
    std::printf("  noise %.4f, mean %.4f\n", frames.noise, frames.mean);
    return frames;
  };
  const Frames plain = render(sphere::AngularKernel::none);
  const Frames smoothed = render(sphere::AngularKernel::epanechnikov);
  EXPECT_LT(smoothed.noise, 0.5 * plain.noise);
  EXPECT_NEAR(smoothed.mean / plain.mean, 1.0, kSanitized ? 0.5 : 0.1);
}

}  // namespace
}  // namespace photosphere::test
