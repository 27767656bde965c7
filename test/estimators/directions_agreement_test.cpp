// Every way of storing and reading directions against path tracing, on a plume with g = 0.7.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "photosphere/core/sampling.h"
#include "support/frames.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using namespace estimators;
using sphere::AngularKernel;
using sphere::DirectionDeposit;

constexpr int kPixels = 48;

struct Row {
  const char* name;
  double mean, relMse;  ///< bounds on |mean ratio - 1| and relMSE of multiple scattering
  std::function<void(LightFieldLayout&)> set;
};

void onParticles(LightFieldLayout& l) {
  l.carrier = Carrier::particles;
  l.deposit = Deposit::collision;
  l.energy = EnergyRule::scatter;
  l.radius = l.depositRadius = 0.04;
}

// Settings of preset = "paper".
void paper(LightFieldLayout& l) {
  onParticles(l);
  l.merge = Merge::sampled;
  l.evaluate = Evaluate::perStep;
  l.angularKernel = AngularKernel::gaussian;
  l.bandwidth = 0.3;
}

// Bounds are about twice what was measured, 2026-11-22. What they say: kernels wider than a bin
// brighten (they blur the forward peak of light into the eye); eq. 7a blurs light out of the
// smoke's edge; one bin a particle is noise.
const Row kRows[] = {
    {"voxels, nearest", 0.03, 0.02, [](LightFieldLayout&) {}},
    {"voxels, barycentric", 0.02, 0.015,
     [](LightFieldLayout& l) { l.direction = DirectionDeposit::barycentric; }},
    {"voxels, kernel deposit 0.3", 0.02, 0.015,
     [](LightFieldLayout& l) {
       l.direction = DirectionDeposit::kernel;
       l.angularKernel = AngularKernel::gaussian;
       l.bandwidth = 0.3;
     }},
    {"voxels, mean", 0.08, 0.02,
     [](LightFieldLayout& l) { l.representative = Representative::mean; }},
    {"voxels, barycentric mean", 0.02, 0.022,
     [](LightFieldLayout& l) {
       l.direction = DirectionDeposit::barycentric;
       l.representative = Representative::mean;
     }},
    {"voxels, gaussian 0.3", 0.1, 0.04,
     [](LightFieldLayout& l) {
       l.angularKernel = AngularKernel::gaussian;
       l.bandwidth = 0.3;
     }},
    {"voxels, gaussian 0.5", 0.22, 0.1,
     [](LightFieldLayout& l) { l.angularKernel = AngularKernel::gaussian; }},
    {"voxels, epanechnikov 0.5", 0.06, 0.026,
     [](LightFieldLayout& l) { l.angularKernel = AngularKernel::epanechnikov; }},
    {"view, gaussian 0.5", 0.22, 0.1,
     [](LightFieldLayout& l) {
       l.basis = Basis::view;
       l.angularKernel = AngularKernel::gaussian;
     }},
    {"view, epanechnikov 0.3", 0.03, 0.02,
     [](LightFieldLayout& l) {
       l.basis = Basis::view;
       l.angularKernel = AngularKernel::epanechnikov;
       l.bandwidth = 0.3;
     }},
    {"voxels, per step", 0.03, 0.02, [](LightFieldLayout& l) { l.evaluate = Evaluate::perStep; }},
    {"particles, gather, per view", 0.64, 2.7,
     [](LightFieldLayout& l) {
       onParticles(l);
       l.energy = EnergyRule::gather;
     }},
    {"particles, scatter, per view", 0.11, 0.33, onParticles},
    {"particles, scatter, per view, sampled", 0.11, 0.33,
     [](LightFieldLayout& l) {
       onParticles(l);
       l.merge = Merge::sampled;
     }},
    {"particles, scatter, per step", 0.08, 0.2,
     [](LightFieldLayout& l) {
       onParticles(l);
       l.evaluate = Evaluate::perStep;
     }},
    {"paper", 0.25, 0.3, paper},
    {"paper, epanechnikov", 0.24, 0.3,
     [](LightFieldLayout& l) {
       paper(l);
       l.angularKernel = AngularKernel::epanechnikov;
       l.bandwidth = 0.7;  // holds about what the gaussian does within 0.3
     }},
};

TEST(DirectionOptions, AgreeWithPathTracingOnThePlume) {
  const RunOnly runOnly;
  TestScene scene = plumeScene(0.7, 64, kPixels);
  scene.particles = seedParticles(*scene.medium, 15000);
  const Truth truth = pathTruth(scene, 384);
  for (const Row& row : kRows) {
    LightFieldLayout layout;
    layout.basis = Basis::histogram;
    layout.channels = 1;
    row.set(layout);
    checkLayout(layout);
    const std::uint64_t photons = layout.carrier == Carrier::voxels ? 100'000 : 40'000;
    const PhotosphereFrame frame = renderPhotosphere(scene, layout, photons, 5);
    EXPECT_EQ(frame.layers.nanSamples + frame.layers.negativeSamples, 0u) << row.name;
    const LayerError error = truth.errorOf(frame.layers, &render::FrameLayers::multiple);
    std::printf("  %-38s mean %.4f  relMSE %.5f  trace %.2f  resolve %.2f  march %.2f s\n",
                row.name, error.meanRatio, error.relMse, frame.traceSeconds, frame.resolveSeconds,
                frame.marchSeconds);
    EXPECT_NEAR(error.meanRatio, 1.0, row.mean) << row.name;
    EXPECT_LT(error.relMse, row.relMse) << row.name;
  }
}

}  // namespace

}  // namespace photosphere::test
