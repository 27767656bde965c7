// Path tracing, the truth, against closed forms and the slab reference.

#include <gtest/gtest.h>

#include <cmath>

#include "photosphere/render/integrator.h"
#include "support/estimate.h"
#include "support/media.h"
#include "support/slab_table.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using render::EnvironmentSampling;
using render::RayRadiance;

double total(const RayRadiance& r) {
  return static_cast<double>(r.total().y);
}

TEST(PathTracing, FurnaceByEscapeIsOneToRounding) {
  const transport::Medium medium =
      makeMedium(sampledVolume(1.0, 32, {1.0, 0.6, 12.0}, plumeDensity));
  transport::LightList lights;
  lights.push_back(makeLight("environment", {}));
  const auto path =
      render::makePathIntegrator(medium, lights, {0, EnvironmentSampling::escape, {}});
  for (const Vec3f d : {Vec3f(1, 0, 0), glm::normalize(Vec3f(0.2f, 0.9f, 0.1f)), Vec3f(0, 0, 1)}) {
    const Estimate e = estimate(*path, Vec3d(d) * -2.0, d, 20000, total);
    EXPECT_NEAR(e.mean, 1.0, 1e-5);
    EXPECT_LT(e.error, 1e-6);
  }
}

TEST(PathTracing, FurnaceByNextEventIsOneWithinFourStandardErrors) {
  const transport::Medium medium =
      makeMedium(sampledVolume(1.0, 32, {1.0, 0.6, 12.0}, plumeDensity));
  transport::LightList lights;
  lights.push_back(makeLight("environment", {}));
  const auto path =
      render::makePathIntegrator(medium, lights, {0, EnvironmentSampling::nextEvent, {}});
  for (const Vec3f d : {Vec3f(1, 0, 0), glm::normalize(Vec3f(0.2f, 0.9f, 0.1f))}) {
    const Estimate e = estimate(*path, Vec3d(d) * -2.0, d, 100000, total);
    EXPECT_NEAR(e.mean, 1.0, 4 * e.error);
    EXPECT_GT(e.error, 0.0);
    EXPECT_LT(e.error, kSanitized ? 0.1 : 0.02);
  }
}

// The switch is of single scattering: light on its way to a second event is taken away as ever.
TEST(PathTracing, ShadowsThatAreOffAreThoseOfSingleScattering) {
  const transport::Medium medium =
      makeMedium(sampledVolume(1.0, 16, {0.9, 0.0, 8.0}, plumeDensity));
  transport::LightList lights;
  lights.push_back(makeLight("point", {{"position", "[0, 2, 0.5]"}, {"intensity", "10"}}));
  render::PathOptions options;
  const auto with = render::makePathIntegrator(medium, lights, options);
  options.effects.shadows = false;
  const auto without = render::makePathIntegrator(medium, lights, options);
  const Vec3f d = glm::normalize(Vec3f(0.02f, 1.0f, 0.01f));
  const int count = kSanitized ? 5000 : 50000;
  const auto single = [](const RayRadiance& r) { return static_cast<double>(r.single.y); };
  const auto multiple = [](const RayRadiance& r) { return static_cast<double>(r.multiple.y); };
  EXPECT_GT(estimate(*without, Vec3d(d) * -2.0, d, count, single).mean,
            1.3 * estimate(*with, Vec3d(d) * -2.0, d, count, single).mean);
  const Estimate a = estimate(*with, Vec3d(d) * -2.0, d, count, multiple);
  const Estimate b = estimate(*without, Vec3d(d) * -2.0, d, count, multiple);
  EXPECT_NEAR(a.mean, b.mean, 4 * std::hypot(a.error, b.error));
  EXPECT_LT(4 * std::hypot(a.error, b.error), 0.2 * a.mean);
}

TEST(PathTracing, TransmittanceFollowsBeerAndLambert) {
  const transport::Medium medium = makeMedium(boxVolume(Vec3d(2.0), Vec3i(16), {0.0, 0.0, 1.5}));
  const transport::LightList lights;
  const auto path = render::makePathIntegrator(medium, lights, {});
  // Straight through, and at 45 degrees through an edge.
  const Estimate straight =
      estimate(*path, {-5, 0.1, 0.2}, {1, 0, 0}, 100000,
               [](const RayRadiance& r) { return static_cast<double>(r.transmittance.x); });
  EXPECT_NEAR(straight.mean, std::exp(-3.0), 4 * straight.error + 1e-6);
  const Vec3f d = glm::normalize(Vec3f(1, 1, 0));
  const Estimate oblique =
      estimate(*path, Vec3d(0.5, -0.5, 0) - Vec3d(d) * 5.0, d, 100000,
               [](const RayRadiance& r) { return static_cast<double>(r.transmittance.x); });
  EXPECT_NEAR(oblique.mean, std::exp(-1.5 * std::sqrt(2.0)), 4 * oblique.error + 1e-6);
}

// A pixel's depth is where what it shows is, so rays count by their opacity, in thin smoke too.
TEST(PathTracing, DepthCountsByOpacity) {
  const transport::LightList lights;
  for (const double sigma : {0.02, 1.5}) {
    const transport::Medium medium =
        makeMedium(boxVolume(Vec3d(2.0), Vec3i(16), {0.0, 0.0, sigma}));
    const auto path = render::makePathIntegrator(medium, lights, {});
    const auto meanOf = [&](float RayRadiance::*value) {
      return estimate(*path, {-5, 0.1, 0.2}, {1, 0, 0}, 20000,
                      [value](const RayRadiance& r) { return static_cast<double>(r.*value); });
    };
    const double passed = std::exp(-2 * sigma);
    const Estimate opacity = meanOf(&RayRadiance::opacity);
    EXPECT_NEAR(opacity.mean, 1 - passed, 4 * opacity.error + 1e-6) << sigma;
    const Estimate depth = meanOf(&RayRadiance::depth);
    const double exact = 4 * (1 - passed) + (1 - passed) / sigma - 2 * passed;
    EXPECT_NEAR(depth.mean, exact, 4 * depth.error + 1e-6) << sigma;
  }
}

struct RadianceCase {
  double tau, albedo, g;
};

class SlabRadiance : public testing::TestWithParam<RadianceCase> {};

TEST_P(SlabRadiance, MatchesTheReferenceWithinFourStandardErrors) {
  const RadianceCase& c = GetParam();
  const transport::Medium medium = slabMedium(c.tau, c.albedo, c.g);
  transport::LightList lights;
  lights.push_back(makeLight("directional", {{"position", "[0, 0, 1]"}, {"target", "[0, 0, 0]"}}));
  const auto path = render::makePathIntegrator(medium, lights, {});
  int checked = 0;
  for (const SlabRow& row : slabTable()) {
    if (row.illumination != "beam" || row.tau != c.tau || row.albedo != c.albedo || row.g != c.g)
      continue;
    const bool top = row.quantity == "L_top";
    if (!top && row.quantity != "L_bottom") continue;
    if (row.at != 0.2 && row.at != 0.5 && row.at != 0.8 && row.at != 1.0) continue;
    const auto mu = static_cast<float>(row.at);
    const float s = std::sqrt(1 - mu * mu);
    const Vec3f d = top ? Vec3f(s, 0, -mu) : Vec3f(s, 0, mu);  // camera ray into the slab
    const Vec3d entry(0, 0, top ? c.tau / 2 : -c.tau / 2);
    const Estimate e = estimate(*path, entry - Vec3d(d), d, 120000, total);
    EXPECT_NEAR(e.mean, row.value, 4 * e.error) << row.quantity << " mu " << row.at;
    EXPECT_LT(e.error, (kSanitized ? 1.0 : 0.2) * row.value) << row.quantity << " mu " << row.at;
    ++checked;
  }
  EXPECT_EQ(checked, 8);
}

INSTANTIATE_TEST_SUITE_P(Reference, SlabRadiance,
                         testing::Values(RadianceCase{0.5, 0.9, 0.0}, RadianceCase{0.5, 0.99, 0.7},
                                         RadianceCase{2, 0.9, 0.7}, RadianceCase{2, 1.0, 0.0},
                                         RadianceCase{8, 0.99, 0.7}, RadianceCase{8, 0.5, 0.0}));

}  // namespace

}  // namespace photosphere::test
