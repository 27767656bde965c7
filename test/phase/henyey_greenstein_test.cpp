// Henyey-Greenstein against its own closed form in long double, quadrature and chi-squared tests.
#include "photosphere/phase/phase.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "photosphere/core/error.h"
#include "photosphere/core/rng.h"
#include "support/support.h"

namespace photosphere::phase {
namespace {

// The textbook form, in long double where its cancellation does not matter.
long double reference(long double g, long double cosine) {
  const long double d = 1 + g * g - 2 * g * cosine;
  return (1 - g * g) / (4 * static_cast<long double>(kPi) * d * std::sqrt(d));
}

// Probability of t = 1 - sign(g) cos being below `t`, from the integral of `reference`.
long double cumulative(long double g, long double t) {
  const long double a = std::abs(g);
  if (a < 1e-9L) return t / 2;
  const long double q = std::sqrt((1 - a) * (1 - a) + 2 * a * t);
  return (1 - a * a) / (2 * a) * (1 / (1 - a) - 1 / q);
}

Vec3d directionAt(double cosine, double sine, double phi) {
  return {sine * std::cos(phi), sine * std::sin(phi), cosine};
}

std::vector<Vec3f> incomingDirections() {
  std::vector<Vec3f> directions{{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, -1, 0}};
  for (const Vec3d& w : {Vec3d(1, 2, 3), Vec3d(-0.2, 0.9, -0.1), Vec3d(1e-4, -1e-4, -1)})
    directions.emplace_back(glm::normalize(w));
  return directions;
}

class Lobe : public ::testing::TestWithParam<double> {};

// Integral over the sphere and of the cosine, by the midpoint rule in ln(t + c), which spreads the
// nodes evenly over the decades of the peak.
TEST_P(Lobe, IntegratesToOneAndToItsMeanCosine) {
  const double g = GetParam(), sign = g < 0 ? -1 : 1;
  const HenyeyGreenstein phase(g);
  const double c = (1 - std::abs(g)) * (1 - std::abs(g)) / 2;
  const int count = 20000;
  const double low = std::log(c), high = std::log(2 + c);
  double sum = 0, moment = 0;
  const Vec3f wi(0, 0, 1);
  for (int i = 0; i < count; ++i) {
    const double e = std::exp(low + (i + 0.5) / count * (high - low));
    const double t = e - c;
    const Vec3f wo(directionAt(sign * (1 - t), std::sqrt(std::max(0.0, t * (2 - t))), 0));
    const double weight = 2 * kPi * e * (high - low) / count;
    sum += phase.evaluate(wi, wo) * weight;
    moment += phase.evaluate(wi, wo) * sign * (1 - t) * weight;
  }
  EXPECT_NEAR(sum, 1.0, 2e-6);
  EXPECT_NEAR(moment, g, 2e-6);
}

// At float directions the true angle is that of the rounded vectors: taken in long double from
// them.
TEST_P(Lobe, MatchesTheClosedForm) {
  const double g = GetParam();
  const HenyeyGreenstein phase(g);
  Rng rng(RandomKey::fromSeed(11, 0), RandomStream::test, 0);
  for (int i = 0; i < 20000; ++i) {
    const Vec3f wi = sampleSphere(rng.uniform2());
    const Vec3f wo = i % 2 ? sampleSphere(rng.uniform2()) : phase.sample(wi, rng.uniform2());
    const double sign = g < 0 ? -1 : 1;
    const Vec3d d = glm::normalize(Vec3d(wo)) - sign * glm::normalize(Vec3d(wi));
    const long double cosine = sign * (1 - static_cast<long double>(glm::dot(d, d)) / 2);
    const long double expected = reference(g, cosine);
    // Unit vectors in float leave the squared distance uncertain by about 1e-7 of itself.
    ASSERT_NEAR(phase.evaluate(wi, wo) / static_cast<double>(expected), 1.0, 2e-6) << i;
  }
}

TEST_P(Lobe, IsReciprocal) {
  const HenyeyGreenstein phase(GetParam());
  Rng rng(RandomKey::fromSeed(12, 0), RandomStream::test, 0);
  for (int i = 0; i < 5000; ++i) {
    const Vec3f a = sampleSphere(rng.uniform2()), b = phase.sample(a, rng.uniform2());
    ASSERT_FLOAT_EQ(phase.evaluate(a, b), phase.evaluate(b, a));
    ASSERT_FLOAT_EQ(phase.evaluate(a, b), phase.evaluate(-b, -a));
  }
}

TEST_P(Lobe, MaximumIsThePeakAndIsNeverExceeded) {
  const double g = GetParam();
  const HenyeyGreenstein phase(g);
  const double a = std::abs(g);
  EXPECT_NEAR(phase.maximum() / ((1 + a) / (4 * kPi * (1 - a) * (1 - a))), 1.0, 1e-6);
  const Vec3f w(glm::normalize(Vec3d(1, -2, 0.5)));
  EXPECT_EQ(phase.evaluate(w, g < 0 ? -w : w), phase.maximum());
  Rng rng(RandomKey::fromSeed(13, 0), RandomStream::test, 0);
  for (int i = 0; i < 5000; ++i) {
    const Vec3f wi = sampleSphere(rng.uniform2());
    ASSERT_LE(phase.evaluate(wi, phase.sample(wi, rng.uniform2())), phase.maximum());
  }
}

// Exact where the chi-squared tests are only statistical: the angle drawn for u has probability 1 -
// u of being smaller.
TEST_P(Lobe, SampleInvertsTheCumulativeDistribution) {
  const double g = GetParam(), sign = g < 0 ? -1 : 1;
  const HenyeyGreenstein phase(g);
  const Vec3f wi(0, 0, 1);
  for (int i = 0; i < 4096; ++i) {
    const float u = (static_cast<float>(i) + 0.5f) / 4096.0f;
    const Vec3d wo(phase.sample(wi, {u, 0.3f}));
    const Vec3d d = wo - sign * Vec3d(wi);
    ASSERT_NEAR(static_cast<double>(cumulative(g, glm::dot(d, d) / 2)), 1 - u, 2e-6) << u;
  }
}

// Cells of equal probability in the closed-form distribution of the angle, times azimuth.
TEST_P(Lobe, SamplesFollowTheClosedForm) {
  const double g = GetParam(), sign = g < 0 ? -1 : 1;
  const HenyeyGreenstein phase(g);
  constexpr int rows = 64, columns = 16, count = 400000;
  std::uint64_t seed = 20;
  for (const Vec3f& wi : incomingDirections()) {
    std::vector<double> observed(rows * columns, 0.0);
    Rng rng(RandomKey::fromSeed(++seed, 0), RandomStream::test, 0);
    const Frame frame = Frame::fromZ(wi);
    for (int i = 0; i < count; ++i) {
      const Vec3d wo(phase.sample(wi, rng.uniform2()));
      const Vec3d d = wo - sign * Vec3d(wi);
      const double u = static_cast<double>(cumulative(g, glm::dot(d, d) / 2));
      double turn = std::atan2(glm::dot(wo, Vec3d(frame.y)), glm::dot(wo, Vec3d(frame.x)));
      turn = turn / (2 * kPi) + (turn < 0 ? 1 : 0);
      const int row = std::clamp(static_cast<int>(u * rows), 0, rows - 1);
      observed[row * columns + std::clamp(static_cast<int>(turn * columns), 0, columns - 1)] += 1;
    }
    const double expected = static_cast<double>(count) / (rows * columns);
    double statistic = 0;
    for (double n : observed)
      statistic += (n - expected) * (n - expected) / expected;
    EXPECT_GT(test::chiSquaredTail(statistic, rows * columns - 1), 1e-4)
        << "wi " << wi.x << ' ' << wi.y << ' ' << wi.z;
  }
}

TEST_P(Lobe, SamplesHaveTheMeanCosine) {
  const double g = GetParam();
  const HenyeyGreenstein phase(g);
  const Vec3f wi(glm::normalize(Vec3d(3, -1, 2)));
  constexpr int count = 1000000;
  Rng rng(RandomKey::fromSeed(40, 0), RandomStream::test, 0);
  double sum = 0;
  for (int i = 0; i < count; ++i)
    sum += glm::dot(Vec3d(phase.sample(wi, rng.uniform2())), Vec3d(wi));
  // The second moment of the cosine is (1 + 2 g^2) / 3.
  const double sigma = std::sqrt((1 - g * g) / 3 / count);
  EXPECT_NEAR(sum / count, g, 4.5 * sigma + 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Phase, Lobe,
                         ::testing::Values(0.0, 1e-8, 0.3, -0.3, 0.7, -0.7, 0.9, 0.99, -0.99,
                                           0.999));

// The shared chi-squared test resolves lobes that are wide against its cells.
TEST(HenyeyGreenstein, SamplesFollowEvaluate) {
  std::uint64_t seed = 60;
  for (double g : {0.0, 0.3, -0.3, 0.7, -0.7}) {
    const HenyeyGreenstein phase(g);
    for (const Vec3f& wi : incomingDirections())
      EXPECT_GT(test::directionChiSquared([&](const Vec2f& u) { return phase.sample(wi, u); },
                                          [&](const Vec3f& w) { return phase.evaluate(wi, w); },
                                          200000, ++seed),
                1e-4)
          << "g " << g << " wi " << wi.x << ' ' << wi.y << ' ' << wi.z;
  }
}

TEST(HenyeyGreenstein, StaysFiniteAndUnitNextToTheLimits) {
  for (double g : {0.99999, -0.99999, 1 - 1e-9, 1 - 1e-16, -1 + 1e-16, 1e-30, -1e-30}) {
    const HenyeyGreenstein phase(g);
    const Vec3f wi(glm::normalize(Vec3d(1, 1, -1)));
    EXPECT_TRUE(std::isfinite(phase.maximum())) << g;
    EXPECT_GT(phase.maximum(), 0.0f) << g;
    for (float u : {0.0f, 0x1p-24f, 0.5f, 1.0f - 0x1p-24f})
      for (float v : {0.0f, 0.25f, 0.7f, 1.0f - 0x1p-24f}) {
        const Vec3f wo = phase.sample(wi, {u, v});
        EXPECT_NEAR(glm::length(Vec3d(wo)), 1.0, 2e-7) << g << ' ' << u << ' ' << v;
        const float f = phase.evaluate(wi, wo);
        EXPECT_TRUE(std::isfinite(f) && f >= 0) << g << ' ' << u << ' ' << v;
      }
  }
}

TEST(HenyeyGreenstein, LengthDoesNotDriftAlongAPath) {
  for (double g : {0.0, 0.9, 0.999}) {
    const HenyeyGreenstein phase(g);
    Rng rng(RandomKey::fromSeed(80, 0), RandomStream::test, 0);
    Vec3f w(0, 0, 1);
    double worst = 0;
    for (int i = 0; i < 300000; ++i) {
      w = phase.sample(w, rng.uniform2());
      worst = std::max(worst, std::abs(glm::length(Vec3d(w)) - 1));
    }
    EXPECT_LT(worst, 2e-7) << g;
  }
}

TEST(HenyeyGreenstein, RefusesWhatIsNoMeanCosine) {
  for (double g : {1.0, -1.0, 1.5, std::nan(""), HUGE_VAL})
    EXPECT_THROW(HenyeyGreenstein{g}, ConfigError) << g;
}

}  // namespace
}  // namespace photosphere::phase
