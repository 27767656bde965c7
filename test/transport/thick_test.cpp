// Smoke so thick that a voxel holds many mean free paths: the walk past its edge stays unbiased and
// short.

#include <gtest/gtest.h>

#include <cmath>

#include "photosphere/transport/tracking.h"
#include "support/media.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using transport::Medium;

// Extinction rises from 0 at the lower face, in one voxel, to `depth` optical depths a voxel.
Medium cliff(double depth, const Mat4d& turn = Mat4d(1.0)) {
  MediumOptions options;
  options.extinction = depth * 16;
  transport::MediumVolume v =
      sampledVolume(1.0, 16, options, [](const Vec3d& p) { return p.z > -0.5 + 1e-9 ? 1.0 : 0.0; });
  v.localFromNode = turn * v.localFromNode;
  return makeMedium(std::move(v));
}

double meanTransmittance(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                         int count, transport::TrackingCounters& counters, double& error) {
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    Rng rng(RandomKey::fromSeed(1, 0), RandomStream::test, static_cast<std::uint64_t>(i));
    const auto t =
        static_cast<double>(transport::trackTransmittance(medium, o, d, length, rng, counters));
    sum += t;
    squares += t * t;
  }
  const double mean = sum / count;
  error = std::sqrt(std::max(0.0, squares / count - mean * mean) / count);
  return mean;
}

// Along the face, where extinction is a small part of the cell's: exp(-sigma) is known.
TEST(ThickSmoke, TransmittanceAlongItsEdgeIsUnbiased) {
  for (const double depth : {1e3, 1e4}) {
    const Medium medium = cliff(depth);
    transport::TrackingCounters counters;
    // Optical depths along the ray of 0.5 and 2: heights above the face in parts of a voxel.
    for (const double wanted : {0.5, 2.0}) {
      const double height = wanted / (depth * 16) / 16;
      const Vec3f o(-0.5f, 0.03f, static_cast<float>(-0.5 + height));
      const double sigma = static_cast<double>(medium.extinction(o + Vec3f(0.5f, 0, 0)));
      double error = 0;
      const int count = kSanitized ? 200 : 2000;
      const double mean =
          meanTransmittance(medium, o, Vec3f(1, 0, 0), 1.0f, count, counters, error);
      EXPECT_NEAR(mean, std::exp(-sigma), 4 * error + 1e-4) << depth << ' ' << wanted;
    }
    EXPECT_EQ(counters.majorantViolations, 0u);
  }
}

// Collisions of rays into the cliff lie where its depth profile, s x^2 / 2, puts them.
TEST(ThickSmoke, CollisionsFollowTheProfile) {
  const double depth = 1e4;
  const Medium medium = cliff(depth);
  transport::TrackingCounters counters;
  const double slope = depth * 16 * 16;  // of extinction [1/m^2]
  double sum = 0;
  const int count = kSanitized ? 500 : 20000;
  for (int i = 0; i < count; ++i) {
    Rng rng(RandomKey::fromSeed(2, 0), RandomStream::test, static_cast<std::uint64_t>(i));
    const transport::Collision hit = transport::sampleCollision(
        medium, Vec3f(0.01f, 0.02f, -0.5f), Vec3f(0, 0, 1), 1.0f, rng, counters);
    ASSERT_TRUE(hit.happened());
    const auto x = static_cast<double>(hit.distance);
    sum += 0.5 * slope * x * x;  // an exponential variable of mean 1
  }
  EXPECT_NEAR(sum / count, 1.0, 4 / std::sqrt(count));
  EXPECT_EQ(counters.majorantViolations, 0u);
}

// A million mean free paths a voxel, past its edge: some thousand lookups, not millions.
TEST(ThickSmoke, TheWalkPastItsEdgeIsShort) {
  Mat4d turn(1.0);
  turn[0] = glm::dvec4(0.8, 0.6, 0, 0);
  turn[1] = glm::dvec4(-0.6, 0.8, 0.3, 0);
  for (const Mat4d& placement : {Mat4d(1.0), turn}) {
    const Medium medium = cliff(1e6, placement);
    transport::TrackingCounters counters;
    const Vec3f o(transformPoint(placement, Vec3d(-0.5, 0.03, -0.5 + 1e-9)));
    const Vec3f d = glm::normalize(Vec3f(Mat3d(placement) * Vec3d(1, 0, 0)));
    double error = 0;
    const int rays = 20;
    meanTransmittance(medium, o, d, 1.0f, rays, counters, error);
    EXPECT_LT(counters.lookups / rays, 200'000u);
    EXPECT_EQ(counters.majorantViolations, 0u);
  }
}

}  // namespace

}  // namespace photosphere::test
