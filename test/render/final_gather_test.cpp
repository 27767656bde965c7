// Final gathering against path tracing, with a source that is exact.

#include <gtest/gtest.h>

#include "support/estimate.h"
#include "support/frames.h"

namespace photosphere::test {

namespace {

using render::RayRadiance;

// In surroundings of radiance 1 and albedo 1 every point scatters sigma_s toward anywhere.
class FurnaceSource final : public estimators::InscatterSource {
 public:
  estimators::Inscatter at(const Vec3f&, const Vec3f&,
                           const transport::Coefficients& c) const override {
    return {Rgb(0.0f), c.scattering[0]};
  }
  bool carriesUnscattered() const override { return true; }
};

TEST(FinalGather, FindsWhatScattersTwiceInAFurnace) {
  const transport::Medium medium =
      makeMedium(sampledVolume(1.0, 32, {1.0, 0.6, 12.0}, plumeDensity));
  transport::LightList lights;
  lights.push_back(makeLight("environment", {}));
  const FurnaceSource source;
  const render::Shadows shadows(medium, lights, render::ShadowMode::march, 0.03f, 0);
  const auto path = render::makePathIntegrator(medium, lights, {});
  for (const int rays : {1, 5}) {
    render::MarchOptions options;
    options.gatherRays = rays;
    const auto gather = render::makeMarchIntegrator(medium, lights, shadows, &source, options);
    const auto multiple = [](const RayRadiance& r) { return static_cast<double>(r.multiple.y); };
    for (const Vec3f d : {Vec3f(1, 0, 0), glm::normalize(Vec3f(0.2f, 0.9f, 0.1f))}) {
      const Estimate truth = estimate(*path, Vec3d(d) * -2.0, d, 100'000, multiple);
      const Estimate found = estimate(*gather, Vec3d(d) * -2.0, d, 30'000, multiple);
      const double error = std::hypot(truth.error, found.error);
      // The march's midpoint rule is behind the last part.
      EXPECT_NEAR(found.mean, truth.mean, 4 * error + 0.003 * truth.mean) << rays;
      EXPECT_LT(error, (kSanitized ? 0.2 : 0.01) * truth.mean);
    }
  }
}

// Nothing scatters twice but what lamps and flames send: the source is dark, and what is found is
// light scattered exactly twice, or emitted and scattered once.
class DarkSource final : public estimators::InscatterSource {
 public:
  estimators::Inscatter at(const Vec3f&, const Vec3f&,
                           const transport::Coefficients&) const override {
    return {};
  }
  bool carriesUnscattered() const override { return false; }
};

TEST(FinalGather, SeesLampsAndFlamesFromTheFirstBounce) {
  transport::MediumVolume v = sampledVolume(1.0, 32, {0.8, 0.4, 10.0}, plumeDensity);
  v.emission = sampledEmission(1.0, 32, [](const Vec3d& p) {
    const Vec3d a = p - Vec3d(0.25, 0.0, -0.1);
    return Rgb(static_cast<float>(3 * std::exp(-60 * glm::dot(a, a))));
  });
  const transport::Medium medium = makeMedium(std::move(v));
  const DarkSource source;
  const Vec3f d(0, 1, 0);
  for (const bool lamp : {true, false}) {
    transport::LightList lights;
    if (lamp)
      lights.push_back(
          makeLight("directional", {{"position", "[1, -1, 2]"}, {"target", "[0, 0, 0]"}}));
    const render::Shadows shadows(medium, lights, render::ShadowMode::track, 0.03f, 0);
    render::MarchOptions options;
    options.gatherRays = 4;
    options.effects.emission = !lamp;
    const auto gather = render::makeMarchIntegrator(medium, lights, shadows, &source, options);
    // Paths of at most two events for the lamp, of one for the flame.
    render::PathOptions few;
    few.maxScatter = lamp ? 2 : 1;
    few.effects.emission = !lamp;
    const auto path = render::makePathIntegrator(medium, lights, few);
    const auto multiple = [](const RayRadiance& r) { return static_cast<double>(r.multiple.y); };
    for (const double x : {0.0, 0.1}) {
      const Vec3d from(x, -2, 0.1);
      const Estimate truth = estimate(*path, from, d, 400'000, multiple);
      const Estimate found = estimate(*gather, from, d, 100'000, multiple);
      const double error = std::hypot(truth.error, found.error);
      EXPECT_GT(truth.mean, 10 * error);
      EXPECT_NEAR(found.mean, truth.mean, 4 * error + 0.005 * truth.mean) << lamp << " " << x;
    }
  }
}

}  // namespace

}  // namespace photosphere::test
