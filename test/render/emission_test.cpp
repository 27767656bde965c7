// Emission along rays against closed forms and the thermal furnace, marched and path-traced.

#include <gtest/gtest.h>

#include <cmath>

#include "photosphere/core/parallel.h"
#include "support/estimate.h"
#include "support/frames.h"

namespace photosphere::test {

namespace {

using render::IntegratorCounters;
using render::RayRadiance;

// A cube of edge 2 with sharp faces that emits evenly.
transport::Medium glowingBox(double sigma, double albedo, const Rgb& j) {
  transport::MediumVolume v = boxVolume(Vec3d(2.0), Vec3i(16), {albedo, 0.0, sigma});
  v.emission = sampledEmission(2.0, 16, [&](const Vec3d&) { return j; });
  return makeMedium(std::move(v));
}

std::unique_ptr<render::Integrator> marcher(const transport::Medium& medium,
                                            const transport::LightList& lights,
                                            const render::Shadows& shadows) {
  return render::makeMarchIntegrator(medium, lights, shadows, nullptr, {});
}

TEST(Emission, EvenBoxMatchesTheClosedForm) {
  const Rgb j(0.7f, 0.2f, 0.0f);
  const transport::LightList lights;
  for (const double sigma : {0.0, 1e-4, 1.0, 6.0}) {
    const transport::Medium medium = glowingBox(sigma, 0.0, j);
    const render::Shadows shadows(medium, lights, render::ShadowMode::march, 0.1f, 0);
    const auto march = marcher(medium, lights, shadows);
    const auto path = render::makePathIntegrator(medium, lights, {});
    const Vec3f d = glm::normalize(Vec3f(1.0f, 0.3f, -0.2f));
    const double length = 2.0 / static_cast<double>(d.x);
    const double exact = 0.7 * (sigma > 0 ? -std::expm1(-sigma * length) / sigma : length);
    IntegratorCounters counters;
    Rng rng(RandomKey::fromSeed(1, 0), RandomStream::camera, 0);
    const RayRadiance r = march->radiance(Vec3d(d) * -5.0, d, {}, rng, counters);
    EXPECT_NEAR(static_cast<double>(r.emission.x), exact, 2e-5 * exact) << sigma;
    EXPECT_NEAR(static_cast<double>(r.emission.y), exact * 2 / 7, 2e-5 * exact) << sigma;
    EXPECT_EQ(r.emission.z, 0.0f);
    EXPECT_EQ(maxComponent(r.single + r.multiple + r.background), 0.0f);
    // Too few paths meet a collision there to know their spread.
    if (kSanitized && sigma == 1e-4) continue;
    const Estimate e = estimate(*path, Vec3d(d) * -5.0, d, 40'000, [](const RayRadiance& p) {
      return static_cast<double>(p.emission.x);
    });
    EXPECT_NEAR(e.mean, exact, 4 * e.error + 2e-5 * exact) << sigma;
    if (sigma == 0) {
      EXPECT_LT(e.error, 1e-5 * exact);
    }
  }
}

// Flames where there is no smoke, and smoke in front of them: a Gaussian ball that emits, an even
// cube that absorbs. The ray crosses both.
TEST(Emission, FlameBehindSmokeIsAttenuatedAndNotLost) {
  std::vector<transport::MediumVolume> volumes;
  volumes.push_back(boxVolume(Vec3d(0.5), Vec3i(8), {0.0, 0.0, 3.0}));
  volumes[0].localFromNode[3].x += 2.0;
  transport::MediumVolume flame;
  flame.emission = sampledEmission(2.0, 128, [](const Vec3d& p) {
    return Rgb(static_cast<float>(std::exp(-8 * glm::dot(p, p))));
  });
  volumes.push_back(std::move(flame));
  const transport::Medium medium(std::move(volumes));
  const transport::LightList lights;
  const render::Shadows shadows(medium, lights, render::ShadowMode::march, 0.1f, 0);
  const auto march = marcher(medium, lights, shadows);
  const auto path = render::makePathIntegrator(medium, lights, {});
  // From the side of the smoke, then from the other side.
  for (const double side : {1.0, -1.0}) {
    const Vec3d from(5 * side, 0.1, 0.05);
    const Vec3f d(static_cast<float>(-side), 0, 0);
    const double along = std::sqrt(kPi / 8) * std::erf(std::sqrt(8.0));
    const double exact = along * std::exp(-8 * (0.01 + 0.0025)) * (side > 0 ? std::exp(-1.5) : 1.0);
    // The cube's sharp faces fall within steps, whose offset is random.
    const Estimate marched = estimate(*march, from, d, 4'000, [](const RayRadiance& p) {
      return static_cast<double>(p.emission.x);
    });
    EXPECT_NEAR(marched.mean, exact, 2e-3 * exact) << side;
    const Estimate e = estimate(*path, from, d, 40'000, [](const RayRadiance& p) {
      return static_cast<double>(p.emission.x);
    });
    EXPECT_NEAR(e.mean, exact, 4 * e.error + 2e-3 * exact) << side;
  }
}

// Emission sigma_a under surroundings of 1: radiance 1 everywhere, whatever the albedo.
TEST(Emission, ThermalFurnaceIsOneWithinFourStandardErrors) {
  for (const double albedo : {0.0, 0.5, 0.9}) {
    transport::MediumVolume v = sampledVolume(1.0, 32, {albedo, 0.6, 12.0}, plumeDensity);
    v.emission = sampledEmission(1.0, 32, [&](const Vec3d& p) {
      return Rgb(static_cast<float>(12.0 * (1 - albedo) * plumeDensity(p)));
    });
    const transport::Medium medium = makeMedium(std::move(v));
    transport::LightList lights;
    lights.push_back(makeLight("environment", {}));
    for (const auto sampling :
         {render::EnvironmentSampling::escape, render::EnvironmentSampling::nextEvent}) {
      const auto path = render::makePathIntegrator(medium, lights, {0, sampling, {}});
      for (const Vec3f d : {Vec3f(1, 0, 0), glm::normalize(Vec3f(0.2f, 0.9f, 0.1f))}) {
        const Estimate e = estimate(*path, Vec3d(d) * -2.0, d, 60'000, [](const RayRadiance& r) {
          return static_cast<double>(r.total().y);
        });
        EXPECT_NEAR(e.mean, 1.0, 4 * e.error) << albedo;
        EXPECT_LT(e.error, kSanitized ? 0.1 : 0.02) << albedo;
      }
    }
  }
}

}  // namespace

}  // namespace photosphere::test
