// Reproducible functions, random numbers, warps and fixed-point sums.

#include <gtest/gtest.h>

#include <cmath>

#include "photosphere/core/fixed_point.h"
#include "photosphere/core/parallel.h"
#include "photosphere/core/rng.h"
#include "photosphere/core/sampling.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

TEST(FastMath, ExpIsCloseAndHasTheRightEnds) {
  for (float x = -87.0f; x < 88.0f; x += 0.0137f)
    EXPECT_NEAR(fastExp(x) / std::exp(static_cast<double>(x)), 1.0, 3e-7) << x;
  EXPECT_EQ(fastExp(-1000.0f), 0.0f);
  EXPECT_EQ(fastExp(-kInfinity), 0.0f);
  EXPECT_EQ(fastExp(1000.0f), kInfinity);
  EXPECT_EQ(fastExp(0.0f), 1.0f);
  EXPECT_TRUE(std::isnan(fastExp(NAN)));
}

TEST(FastMath, LogIsClose) {
  for (double x = 1e-37; x < 1e37; x *= 1.0137) {
    const auto f = static_cast<float>(x);
    const double exact = std::log(static_cast<double>(f));
    EXPECT_NEAR(fastLog(f), exact, 1e-7 + 2e-7 * std::abs(exact)) << x;
  }
  EXPECT_EQ(fastLog(1.0f), 0.0f);
}

TEST(FastMath, SinCosAreClose) {
  for (float t = 0.0f; t <= 1.0f; t += 0.00037f) {
    const SinCos sc = fastSinCosTurns(t);
    EXPECT_NEAR(sc.sin, std::sin(2 * kPi * static_cast<double>(t)), 1e-6) << t;
    EXPECT_NEAR(sc.cos, std::cos(2 * kPi * static_cast<double>(t)), 1e-6) << t;
  }
}

TEST(Rng, IsAFunctionOfItsCounters) {
  const RandomKey key = RandomKey::fromSeed(1, 2);
  Rng a(key, RandomStream::photon, 5), b(key, RandomStream::photon, 5),
      c(key, RandomStream::photon, 6), d(key, RandomStream::camera, 5),
      e(RandomKey::fromSeed(1, 3), RandomStream::photon, 5);
  for (int i = 0; i < 9; ++i) {
    const std::uint32_t x = a.bits();
    EXPECT_EQ(x, b.bits());
    EXPECT_NE(x, c.bits());
    EXPECT_NE(x, d.bits());
    EXPECT_NE(x, e.bits());
  }
}

TEST(Rng, UniformsStayInTheirIntervalsAndFillThem) {
  Rng rng(RandomKey::fromSeed(4, 0), RandomStream::test, 0);
  double sum = 0, squares = 0;
  constexpr int n = 200000;
  for (int i = 0; i < n; ++i) {
    const float u = rng.uniform(), v = rng.uniformPositive();
    ASSERT_TRUE(u >= 0.0f && u < 1.0f && v > 0.0f && v <= 1.0f);
    sum += static_cast<double>(u);
    squares += static_cast<double>(u) * static_cast<double>(u);
  }
  EXPECT_NEAR(sum / n, 0.5, 4 / std::sqrt(12.0 * n));
  EXPECT_NEAR(squares / n, 1.0 / 3, 0.004);
}

TEST(Sampling, WarpsFollowTheirDensities) {
  const auto sphere = [](const Vec2f& u) { return sampleSphere(u); };
  EXPECT_GT(directionChiSquared(
                sphere, [](const Vec3f&) { return 1 / (4 * kPi); }, 400000, 1),
            1e-4);
  const auto hemisphere = [](const Vec2f& u) { return sampleCosineHemisphere(u); };
  EXPECT_GT(
      directionChiSquared(
          hemisphere, [](const Vec3f& w) { return std::max(0.0, static_cast<double>(w.z)) / kPi; },
          400000, 2),
      1e-4);
  // Cells of the test are 1/20 high in z: the cone's rim lies on one's border.
  const auto cone = [](const Vec2f& u) { return sampleCone(u, 0.5f); };
  EXPECT_GT(directionChiSquared(
                cone, [](const Vec3f& w) { return w.z > 0.5f ? 1 / kPi : 0.0; }, 400000, 3),
            1e-4);
  // The test has teeth: the wrong density fails.
  EXPECT_LT(directionChiSquared(
                hemisphere, [](const Vec3f&) { return 1 / (4 * kPi); }, 400000, 4),
            1e-6);
}

TEST(Sampling, DiscIsEven) {
  Rng rng(RandomKey::fromSeed(9, 0), RandomStream::test, 0);
  constexpr int n = 200000;
  int inner = 0, right = 0;
  for (int i = 0; i < n; ++i) {
    const Vec2f p = sampleDisc(rng.uniform2());
    const float r2 = p.x * p.x + p.y * p.y;
    ASSERT_LE(r2, 1.00001f);
    inner += r2 < 0.25f;
    right += p.x > 0;
  }
  EXPECT_NEAR(inner, n / 4.0, 4 * std::sqrt(n * 0.1875));
  EXPECT_NEAR(right, n / 2.0, 4 * std::sqrt(n * 0.25));
}

TEST(Sampling, FramesAreOrthonormal) {
  Rng rng(RandomKey::fromSeed(10, 0), RandomStream::test, 0);
  for (int i = 0; i < 2000; ++i) {
    const Vec3f n = i == 0   ? Vec3f(0, 0, -1)
                    : i == 1 ? Vec3f(0, 0, 1)
                             : sampleSphere(rng.uniform2());
    const Frame f = Frame::fromZ(n);
    EXPECT_NEAR(glm::dot(f.x, f.y), 0, 2e-6);
    EXPECT_NEAR(glm::dot(f.x, f.z), 0, 2e-6);
    EXPECT_NEAR(glm::dot(f.x, f.x), 1, 2e-6);
    EXPECT_NEAR(glm::dot(glm::cross(f.x, f.y), f.z), 1, 2e-6);
  }
}

TEST(FixedPoint, RoundingIsUnbiased) {
  Rng rng(RandomKey::fromSeed(11, 0), RandomStream::test, 0);
  for (const double value : {0.001, 0.3, 0.999, 7.25}) {
    double sum = 0;
    constexpr int n = 400000;
    for (int i = 0; i < n; ++i)
      sum += static_cast<double>(quantize(value, 1.0, rng.bits()));
    const double fraction = value - std::floor(value);
    EXPECT_NEAR(sum / n, value, 4 * std::sqrt(fraction * (1 - fraction) / n) + 1e-9);
  }
}

TEST(FixedPoint, OverflowIsSeen) {
  std::int64_t sum = INT64_MAX - 5;
  EXPECT_TRUE(addChecked(sum, 5));
  EXPECT_FALSE(addChecked(sum, 1));
}

TEST(FixedPoint, ThreadsAddWithoutLoss) {
  std::int64_t sum = 0;
  const ThreadLimit limit(4);
  parallelFor(100000, 100, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      addChecked(sum, static_cast<std::int64_t>(i));
  });
  EXPECT_EQ(sum, 100000ll * 99999 / 2);
}

TEST(Parallel, CoversTheRangeOnceAndPassesExceptionsOn) {
  std::vector<int> visits(10007, 0);
  parallelFor(visits.size(), 13, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      ++visits[i];
  });
  for (const int v : visits)
    EXPECT_EQ(v, 1);
  EXPECT_THROW(parallelFor(10, 1, [](std::size_t, std::size_t) { throw std::runtime_error("x"); }),
               std::runtime_error);
}

}  // namespace

}  // namespace photosphere::test
