// Smoke that moves while the shutter is open: lookups, bounds, shadows.

#include <gtest/gtest.h>

#include "photosphere/render/integrator.h"
#include "photosphere/render/shadows.h"
#include "photosphere/transport/support_lattice.h"
#include "photosphere/transport/tracking.h"
#include "support/estimate.h"
#include "support/media.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

using transport::Medium;
using transport::MediumVolume;
using transport::Moment;
using transport::Shutter;

constexpr Shutter kShutter{-0.1, 0.3};

// Velocity where the smoke is and around it.
Medium moving(MediumVolume v, const std::function<Vec3d(const Vec3d&)>& velocity,
              const Shutter& shutter = kShutter) {
  v.motion = sampledMotion(2.0, 64, velocity);
  std::vector<MediumVolume> volumes;
  volumes.push_back(std::move(v));
  return Medium(std::move(volumes), shutter);
}

MediumVolume plume() {
  return sampledVolume(1.0, 64, {.albedo = 0.9, .extinction = 20.0}, plumeDensity);
}

TEST(MovingSmoke, EvenVelocityShiftsIt) {
  const Vec3d v(0.5, -0.2, 0.3);
  const Medium still = makeMedium(plume());
  const Medium medium = moving(plume(), [&](const Vec3d&) { return v; });
  ASSERT_TRUE(medium.isMoving());
  EXPECT_NEAR(medium.displacement(), 0.3 * glm::length(v), 1e-6);
  EXPECT_NE(medium.hash(), still.hash());
  Rng rng(RandomKey::fromSeed(1, 0), RandomStream::camera, 0);
  int inside = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3f p = Vec3f(rng.uniform(), rng.uniform(), rng.uniform()) - 0.5f;
    const Moment when{static_cast<float>(-0.1 + 0.4 * static_cast<double>(rng.uniform()))};
    const Vec3f before = p - when.seconds * Vec3f(v);
    EXPECT_NEAR(medium.extinction(p, when), still.extinction(before), 2e-3f);
    inside += still.extinction(before) > 0.0f ? 1 : 0;
    transport::Coefficients a, b;
    medium.coefficients(p, a, when);
    still.coefficients(before, b);
    EXPECT_NEAR(a.scattering[0].x, b.scattering[0].x, 2e-3f);
    EXPECT_NEAR(glm::length(medium.carrierOf(p, when) - before), 0.0f, 1e-5f);
  }
  EXPECT_GT(inside, 200);
}

// What is at x0 goes to x0 + t v(x0): found again there where the velocity varies gently.
TEST(MovingSmoke, FollowsAVelocityThatVaries) {
  const auto spin = [](const Vec3d& p) { return Vec3d(-p.y, p.x, 0.2 * p.z) * 1.5; };
  const Medium still = makeMedium(plume());
  const Medium medium = moving(plume(), spin);
  Rng rng(RandomKey::fromSeed(1, 0), RandomStream::camera, 0);
  double worst = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3d x0 = 0.8 * (Vec3d(rng.uniform(), rng.uniform(), rng.uniform()) - 0.5);
    const float t = -0.1f + 0.4f * rng.uniform();
    const Vec3f x(x0 + static_cast<double>(t) * spin(x0));
    worst = std::max(worst, glm::length(Vec3d(medium.carrierOf(x, {t})) - x0));
  }
  // The third step of the series that two steps leave out: (t |grad v|)^3 |x|.
  EXPECT_LT(worst, 0.45 * 0.45 * 0.45 * 0.6);
}

TEST(MovingSmoke, MajorantsBoundEveryMoment) {
  const Medium medium =
      moving(plume(), [](const Vec3d& p) { return Vec3d(0.9 - p.z, 0.4 * p.x, -0.5); });
  Rng rng(RandomKey::fromSeed(5, 0), RandomStream::camera, 0);
  const Vec3f low(medium.bounds().min), size(medium.bounds().extent());
  for (int i = 0; i < 40'000; ++i) {
    const Vec3f p = low + size * Vec3f(rng.uniform(), rng.uniform(), rng.uniform());
    const Vec3i cell = glm::clamp(Vec3i((p - low) / medium.majorants().cellSize()), Vec3i(0),
                                  medium.majorants().dims() - 1);
    const float sigma = medium.extinction(p, {-0.1f + 0.4f * rng.uniform()});
    ASSERT_LE(sigma, medium.majorants().majorant(cell) * 1.001f);
  }
  // Nothing moves out of the bounds.
  for (int i = 0; i < 4000; ++i) {
    const Vec3f p =
        low - 0.01f * size + 1.02f * size * Vec3f(rng.uniform(), rng.uniform(), rng.uniform());
    if (medium.bounds().contains(Vec3d(p))) continue;
    ASSERT_EQ(medium.extinction(p, {0.3f}), 0.0f);
  }
}

// A slab that enters the ray while the shutter is open: each moment's transmittance is Beer's.
TEST(MovingSmoke, BlurIsTheMeanOverTheShutter) {
  const Vec3d v(1.0, 0.0, 0.0);
  const Medium medium =
      moving(boxVolume(Vec3d(1.0), Vec3i(8), {.extinction = 2.0}), [&](const Vec3d&) { return v; });
  const auto through = [&](const Vec3f& p, float t) {
    return transport::marchOpticalDepth(medium, p - Vec3f(0, 0.7f, 0), Vec3f(0, 1, 0), 1.4f, 0.01f,
                                        Moment{t});
  };
  // The face x = 1/2 reaches x at t = x - 1/2.
  for (const float x : {0.45f, 0.55f, 0.65f, 0.75f})
    for (const float t : {-0.08f, 0.02f, 0.12f, 0.22f, 0.28f})
      EXPECT_NEAR(through({x, 0, 0.01f}, t), x - t < 0.5f ? 2.0f : 0.0f, 0.03f)
          << "x " << x << ", t " << t;
  // And a lattice that is to hold shadows reaches as far.
  const transport::SupportLattice lattice(medium, 0.05, 0);
  EXPECT_GE(lattice.number(Vec3i((Vec3d(0.78, 0, 0) - lattice.origin()) / 0.05)), 0);
}

TEST(MovingSmoke, ShadowTablesFollow) {
  const Medium medium =
      moving(sampledVolume(1.0, 32, {.albedo = 0.9, .extinction = 20.0}, plumeDensity),
             [](const Vec3d&) { return Vec3d(0.4, 0.0, 0.1); });
  const transport::LightList lights = lampsBesideAndWithin();
  const auto step = static_cast<float>(medium.voxelEdge());
  const render::Shadows table(medium, lights, render::ShadowMode::grid, step, 0);
  const render::Shadows march(medium, lights, render::ShadowMode::march, step / 2, 0);
  Rng rng(RandomKey::fromSeed(9, 0), RandomStream::camera, 0);
  transport::TrackingCounters counters;
  double error = 0, frozen = 0;
  int count = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3f p = 0.8f * (Vec3f(rng.uniform(), rng.uniform(), rng.uniform()) - 0.5f);
    const Moment when{-0.1f + 0.4f * rng.uniform()};
    if (!(medium.extinction(p, when) > 0.0f)) continue;
    for (std::size_t light = 0; light < 2; ++light) {
      const lights::Illumination in = lights[light]->illuminate(p, Vec2f(0.5f));
      const auto at = [&](const render::Shadows& shadows, Moment t) {
        return static_cast<double>(
            shadows.transmittance(light, p, in.direction, in.distance, rng, counters, t));
      };
      const double truth = at(march, when);
      error += std::abs(at(table, when) - truth);
      frozen += std::abs(at(march, {0.0f}) - truth);
      ++count;
    }
  }
  ASSERT_GT(count, 200);
  EXPECT_LT(error / count, 0.02);
  EXPECT_GT(frozen, 4 * error) << "smoke that holds still shadows otherwise";
}

TEST(MovingSmoke, AtRestItIsTheSameSmoke) {
  Medium medium = moving(plume(), [](const Vec3d&) { return Vec3d(1.0); });
  const Medium held = std::move(medium).held();
  EXPECT_FALSE(held.isMoving());
  EXPECT_EQ(held.hash(), makeMedium(plume()).hash());
  // A shutter that only opens at the frame's own time moves nothing.
  EXPECT_FALSE(moving(plume(), [](const Vec3d&) { return Vec3d(1.0); }, {0.0, 0.0}).isMoving());
}

}  // namespace
}  // namespace photosphere::test
