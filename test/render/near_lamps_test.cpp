// Lamps in the smoke, whose light path tracing finds in two ways, against quadrature and against
// path tracing that has one way alone.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "support/estimate.h"
#include "support/media.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using render::RayRadiance;

const Vec3d kLamp(0.1, 0.05, -0.08);

std::unique_ptr<lights::Light> lamp(double intensity, double radius = 0) {
  return makeLight("point", {{"position", fmt::format("[{}, {}, {}]", kLamp.x, kLamp.y, kLamp.z)},
                             {"intensity", fmt::format("{}", intensity)},
                             {"radius", fmt::format("{}", radius)}});
}

// The lamp among so many, all but dark, that each is drawn for its place and none is near.
transport::LightList amongMany(double radius) {
  transport::LightList lights;
  lights.push_back(lamp(1.0, radius));
  for (int i = 0; i < 64; ++i)
    lights.push_back(lamp(1e-9));
  return lights;
}

transport::LightList one(double radius = 0) {
  transport::LightList lights;
  lights.push_back(lamp(1.0, radius));
  return lights;
}

double single(const RayRadiance& r) {
  return static_cast<double>(r.single.y);
}
double multiple(const RayRadiance& r) {
  return static_cast<double>(r.multiple.y);
}

// Of a ray along x through even smoke that passes the lamp at distance `aside`:
// albedo sigma / 4 pi times the integral of exp(-sigma (x + r)) / r^2.
TEST(NearLamps, SingleScatteringIsThatOfQuadrature) {
  const double sigma = 0.8, albedo = 0.7;
  const transport::Medium medium =
      makeMedium(boxVolume(Vec3d(2.0), Vec3i(16), {albedo, 0.0, sigma}));
  const transport::LightList lights = one();
  const auto path = render::makePathIntegrator(medium, lights, {});
  for (const double aside : {0.3, 0.02, 0.001}) {
    double expected = 0;
    // Even in the angle under which the lamp sees the ray.
    const double from = std::atan((-1 - kLamp.x) / aside), to = std::atan((1 - kLamp.x) / aside);
    constexpr int nodes = 20000;
    for (int i = 0; i < nodes; ++i) {
      const double angle = from + (to - from) * (i + 0.5) / nodes;
      const double x = kLamp.x + aside * std::tan(angle), r = aside / std::cos(angle);
      expected += std::exp(-sigma * (x + 1 + r)) / aside;
    }
    expected *= albedo * sigma / (4 * 3.14159265358979323846) * (to - from) / nodes;
    const Vec3d origin(-5, kLamp.y, kLamp.z + aside);
    const Estimate e = estimate(*path, origin, {1, 0, 0}, 100000, single);
    EXPECT_NEAR(e.mean, expected, 4 * e.error) << aside;
    EXPECT_LT(e.error, (kSanitized ? 0.05 : 0.01) * expected) << aside;
  }
}

class NearLampsAgree : public testing::TestWithParam<double> {};

TEST_P(NearLampsAgree, WithWhatPathsFindByCollisionsAlone) {
  const double radius = GetParam();
  transport::MediumVolume volume = sampledVolume(2.0, 24, {0.9, 0.4, 2.0}, [](const Vec3d& p) {
    return std::max(0.0, 1 - glm::length(p - Vec3d(0.2, 0.1, -0.2)));
  });
  for (const Rgb& tint : {Rgb(1.0f), Rgb(0.4f, 0.6f, 1.0f)}) {
    volume.tint = tint;
    const transport::Medium medium = makeMedium(volume);
    const transport::LightList near = one(radius), plain = amongMany(radius);
    const auto a = render::makePathIntegrator(medium, near, {});
    const auto b = render::makePathIntegrator(medium, plain, {});
    for (const auto& pick : {single, multiple}) {
      const Estimate ours = estimate(*a, {-5, 0.2, -0.1}, {1, 0, 0}, 40000, pick);
      const Estimate theirs = estimate(*b, {-5, 0.2, -0.1}, {1, 0, 0}, 80000, pick);
      EXPECT_NEAR(ours.mean, theirs.mean, 4 * std::hypot(ours.error, theirs.error))
          << radius << ' ' << tint.x;
      EXPECT_GT(ours.mean, 10 * ours.error);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Radii, NearLampsAgree, testing::Values(0.0, 0.03));

TEST(NearLamps, OnlyLampsThatStandSomewhereHaveAPlace) {
  const auto point = lamp(1.0)->place();
  ASSERT_TRUE(point);
  EXPECT_EQ(point->center, kLamp);
  EXPECT_EQ(point->extent, 0.0);
  const auto ball = lamp(1.0, 0.25)->place();
  ASSERT_TRUE(ball);
  EXPECT_EQ(ball->center, kLamp);
  EXPECT_EQ(ball->extent, 0.25);
  EXPECT_TRUE(makeLight("spot", {{"position", "[1, 2, 3]"}, {"target", "[0, 0, 0]"}})->place());
  EXPECT_TRUE(makeLight("disk", {{"position", "[1, 2, 3]"}, {"target", "[0, 0, 0]"}})->place());
  EXPECT_FALSE(
      makeLight("directional", {{"position", "[0, 0, 1]"}, {"target", "[0, 0, 0]"}})->place());
  EXPECT_FALSE(makeLight("environment", {})->place());
}

}  // namespace

}  // namespace photosphere::test
