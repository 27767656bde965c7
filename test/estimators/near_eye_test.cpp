// An eye in smoke that scatters into a lobe: carriers next to it are seen from all sides.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "photosphere/estimators/light_sums.h"
#include "support/media.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

using namespace estimators;

constexpr double kEdge = 1.0 / 32;  // of a density voxel
constexpr double kG = 0.5;
constexpr std::uint64_t kPhotons = 200'000;

// Smoke so thin that all the light in it is that of a small lamp far away on the +x axis, 1 W/m^2:
// radiance times pi (0.6 / 60)^2.
struct ThinSmoke {
  transport::Medium medium =
      makeMedium(boxVolume(Vec3d(1), Vec3i(32), {.albedo = 1.0, .g = kG, .extinction = 1e-4}));
  transport::LightList lights;
  View view;

  ThinSmoke() {
    lights.push_back(makeLight(
        "sphere", {{"position", "[60, 0, 0]"}, {"radius", "0.6"}, {"intensity", "3183.0988618"}}));
    view.eye = {0.03, -0.01, 0.02};
  }

  LightSums trace(const LightFieldLayout& layout, std::uint64_t first = 0,
                  std::uint64_t count = ~0ull) const {
    transport::TraceOptions options;
    options.photons = kPhotons;
    options.firstPhoton = first;
    options.photonCount = count;
    transport::TraceStatistics statistics;
    std::vector<Vec3f> particles;
    if (layout.carrier == Carrier::particles)
      for (int i = 0; i < 16 * 16 * 16; ++i)
        particles.push_back((Vec3f(i % 16, i / 16 % 16, i / 256) + 0.5f) / 16.0f - 0.5f);
    return traceLightSums(medium, lights, layout, view, particles, options, statistics);
  }

  // Light scattered once toward the eye next to it, over what it is, looking `angle` away from the
  // lamp.
  double atEye(const InscatterSource& source, double angle) const {
    const Vec3f d(Vec3d(std::cos(angle), std::sin(angle), 0));
    const Vec3f p = Vec3f(view.eye) + d * static_cast<float>(0.7 * 2 * kEdge);
    transport::Coefficients c;
    medium.coefficients(p, c, transport::Still());
    const float phase = medium.phases()[0].evaluate(Vec3f(-1, 0, 0), -d);
    return static_cast<double>(source.at(p, -d, c).single.x / (c.scattering[0].x * phase));
  }
};

LightFieldLayout layoutOf(Basis basis, double nearEye) {
  LightFieldLayout layout;
  layout.basis = basis;
  layout.rows = 6;
  layout.order = 8;
  layout.channels = 1;
  layout.unscattered = true;
  layout.radius = layout.depositRadius = 1.5 * 2 * kEdge;
  layout.nearEye = nearEye;
  return layout;
}

struct Kept {
  const char* name;
  double seam;  // relative; what is blurred and not sharpened is farther off
  LightFieldLayout (*layout)(double nearEye);
};

std::ostream& operator<<(std::ostream& out, const Kept& kept) {
  return out << kept.name;
}

class NearEye : public testing::TestWithParam<Kept> {};

TEST_P(NearEye, LobesKeepTheirShape) {
  const ThinSmoke smoke;
  const auto light = [&](double nearEye) {
    return resolve(smoke.medium, toField(smoke.trace(GetParam().layout(nearEye))), smoke.view);
  };
  const auto joined = light(3), far = light(0);
  for (const double degrees : {0.0, 10.0, 30.0, 60.0, 90.0, 180.0})
    EXPECT_NEAR(smoke.atEye(*joined, degrees * kPi / 180), 1.0, 0.12) << degrees;
  // What it is about: the mean over directions is far from the peak.
  EXPECT_LT(smoke.atEye(*far, 0), 0.7);
}

// The same light on both sides of the border, where the eye is far enough.
TEST_P(NearEye, NoSeamWhereItEnds) {
  const ThinSmoke smoke;
  const auto source = resolve(smoke.medium, toField(smoke.trace(GetParam().layout(3))), smoke.view);
  const double border = 3 * 2 * kEdge;
  for (const double degrees : {0.0, 60.0, 150.0}) {
    const Vec3f d(Vec3d(std::cos(degrees * kPi / 180), std::sin(degrees * kPi / 180), 0));
    double light[2];
    for (const int side : {0, 1}) {
      const Vec3f p =
          Vec3f(smoke.view.eye) + d * static_cast<float>(border * (side ? 1.001 : 0.999));
      transport::Coefficients c;
      smoke.medium.coefficients(p, c, transport::Still());
      light[side] = static_cast<double>(source->at(p, -d, c).single.x / c.scattering[0].x);
    }
    EXPECT_NEAR(light[1] / light[0], 1.0, GetParam().seam) << degrees;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Bases, NearEye,
    testing::Values(Kept{"view", 0.1, [](double n) { return layoutOf(Basis::view, n); }},
                    Kept{"view_kernel", 0.1,
                         [](double n) {
                           LightFieldLayout l = layoutOf(Basis::view, n);
                           l.angularKernel = sphere::AngularKernel::epanechnikov;
                           l.bandwidth = 0.2;
                           return l;
                         }},
                    Kept{"view_visible", 0.25,
                         [](double n) {
                           LightFieldLayout l = layoutOf(Basis::view, n);
                           l.smoothing = Smoothing::visible;
                           return l;
                         }},
                    Kept{"histogram", 0.1, [](double n) { return layoutOf(Basis::histogram, n); }},
                    Kept{"harmonics", 0.1,
                         [](double n) { return layoutOf(Basis::sphericalHarmonics, n); }},
                    Kept{"harmonics_visible", 0.25,
                         [](double n) {
                           LightFieldLayout l = layoutOf(Basis::sphericalHarmonics, n);
                           l.smoothing = Smoothing::visible;
                           return l;
                         }},
                    Kept{"particles_view", 0.2,
                         [](double n) {
                           LightFieldLayout l = layoutOf(Basis::view, n);
                           l.carrier = Carrier::particles;
                           return l;
                         }},
                    Kept{"particles", 0.2,
                         [](double n) {
                           LightFieldLayout l = layoutOf(Basis::histogram, n);
                           l.carrier = Carrier::particles;
                           return l;
                         }}),
    [](const auto& kept) { return std::string(kept.param.name); });

TEST(NearEyeSums, PartsAddUpToTheWhole) {
  const ThinSmoke smoke;
  const LightFieldLayout layout = layoutOf(Basis::view, 3);
  const LightSums whole = smoke.trace(layout);
  ASSERT_TRUE(whole.near);
  EXPECT_TRUE(std::any_of(whole.near->sums.begin(), whole.near->sums.end(),
                          [](std::int64_t sum) { return sum != 0; }));
  LightSums parts = smoke.trace(layout, kPhotons / 3);
  addSums(parts, smoke.trace(layout, 0, kPhotons / 3));
  EXPECT_EQ(parts.near->sums, whole.near->sums);
  EXPECT_EQ(parts.sums, whole.sums);
}

// What lies near the eye does not change what is stored elsewhere, nor what is read there.
TEST(NearEyeSums, TheRestStays) {
  const ThinSmoke smoke;
  LightSums with = smoke.trace(layoutOf(Basis::view, 3));
  LightSums without = smoke.trace(layoutOf(Basis::view, 0));
  EXPECT_FALSE(without.near);
  EXPECT_EQ(with.sums, without.sums);
  const auto a = resolve(smoke.medium, toField(std::move(with)), smoke.view);
  const auto b = resolve(smoke.medium, toField(std::move(without)), smoke.view);
  const Vec3f p(0.3f, 0.1f, -0.2f), wo = smoke.view.toEye(p);
  transport::Coefficients c;
  smoke.medium.coefficients(p, c, transport::Still());
  EXPECT_EQ(a->at(p, wo, c).single, b->at(p, wo, c).single);
}

// Power is read off particles as it was left: their one colour has no place for directions.
TEST(NearEyeSums, PowerOnParticlesKeepsNone) {
  const ThinSmoke smoke;
  LightFieldLayout layout = layoutOf(Basis::view, 3);
  layout.carrier = Carrier::particles;
  layout.deposit = Deposit::collision;
  EXPECT_EQ(nearEyeBytes(smoke.medium, layout, smoke.view), 0u);
  EXPECT_FALSE(smoke.trace(layout).near);
}

// However wide the kernel is, it is no more than the smoke.
TEST(NearEyeSums, MemoryIsThatOfTheSmoke) {
  const ThinSmoke smoke;
  LightFieldLayout layout = layoutOf(Basis::view, 3);
  layout.radius = 1e6;
  layout.lightVoxel = 1e-3;
  EXPECT_LE(nearEyeBytes(smoke.medium, layout, smoke.view), std::uint64_t{1} << 60);
  layout = layoutOf(Basis::view, 3);
  EXPECT_LT(nearEyeBytes(smoke.medium, layout, smoke.view), 64u << 20);
}

// Nothing is kept where no smoke is near, or nobody looks.
TEST(NearEyeSums, OnlyAroundAnEyeInSmoke) {
  ThinSmoke smoke;
  const LightFieldLayout layout = layoutOf(Basis::view, 3);
  EXPECT_GT(nearEyeBytes(smoke.medium, layout, smoke.view), 0u);
  smoke.view.eye = {0, 0, 3};
  EXPECT_FALSE(smoke.trace(layout).near);
  EXPECT_EQ(nearEyeBytes(smoke.medium, layout, smoke.view), 0u);
  smoke.view.eye = {0, 0, 0};
  smoke.view.hasEye = false;
  EXPECT_FALSE(smoke.trace(layout).near);
}

}  // namespace
}  // namespace photosphere::test
