// Collisions that stand for a whole ray, against those that happen.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "photosphere/transport/tracking.h"
#include "support/media.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using transport::Medium;

constexpr int kBins = 5;
constexpr float kLength = 1.6f;
const Vec3f kOrigin(-0.5f, -0.45f, -0.4f);
const Vec3f kDirection = glm::normalize(Vec3f(1.0f, 0.8f, 0.9f));

Medium plume(double extinction, const Rgb& tint = Rgb(1.0f)) {
  transport::MediumVolume volume = sampledVolume(1.0, 32, {0.9, 0.3, extinction}, plumeDensity);
  volume.tint = tint;
  return makeMedium(std::move(volume));
}

struct Mean {
  double sum = 0, squares = 0;
  void add(double v) {
    sum += v;
    squares += v * v;
  }
  double mean(int n) const { return sum / n; }
  double variance(int n) const { return std::max(0.0, squares / n - mean(n) * mean(n)); }
  double error(int n) const { return std::sqrt(variance(n) / n); }
};

class ForcedCollisions : public testing::TestWithParam<double> {};

TEST_P(ForcedCollisions, AreWhereTheFirstRealOnesAreOnTheMean) {
  const Medium medium = plume(GetParam());
  const int n = kSanitized ? 4000 : 100000;
  std::array<Mean, kBins> forced, real;
  Mean weight, met, transmittance;
  transport::TrackingCounters counters;
  for (int i = 0; i < n; ++i) {
    Rng rng(RandomKey::fromSeed(2, 0), RandomStream::test, static_cast<std::uint64_t>(i));
    const auto all = transport::forceCollision<float>(Rgb(1.0f), medium, kOrigin, kDirection,
                                                      kLength, rng, counters);
    const transport::Collision one =
        transport::sampleCollision(medium, kOrigin, kDirection, kLength, rng, counters);
    ASSERT_EQ(all.weight > 0.0f, all.hit.happened());
    ASSERT_NEAR(all.weight + all.transmittance, 1.0f, 1e-5f);
    for (int bin = 0; bin < kBins; ++bin) {
      const auto in = [bin](const transport::Collision& hit) {
        return hit.happened() && static_cast<int>(hit.distance / kLength * kBins) == bin;
      };
      const auto b = static_cast<std::size_t>(bin);
      forced[b].add(in(all.hit) ? static_cast<double>(all.weight) : 0.0);
      real[b].add(in(one) ? 1.0 : 0.0);
    }
    weight.add(static_cast<double>(all.weight));
    transmittance.add(static_cast<double>(all.transmittance));
    met.add(one.happened() ? 1.0 : 0.0);
  }
  const auto marched = [&medium](float length) {
    return std::exp(-static_cast<double>(
        transport::marchOpticalDepth(medium, kOrigin, kDirection, length, 1e-3f)));
  };
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const auto begin = static_cast<float>(bin) * kLength / kBins;
    const double there = marched(begin) - marched(begin + kLength / kBins);
    EXPECT_NEAR(forced[bin].mean(n), there, 4.5 * forced[bin].error(n) + 1e-3 * there) << bin;
    if (there > 1e-3) {
      EXPECT_NEAR(real[bin].mean(n), there, 4.5 * real[bin].error(n) + 1e-3 * there) << bin;
    }
  }
  const double expected = marched(kLength);
  EXPECT_NEAR(transmittance.mean(n), expected, 4.5 * transmittance.error(n) + 1e-4 * expected);
  EXPECT_NEAR(weight.mean(n), 1 - expected, 4.5 * weight.error(n) + 1e-4 * (1 - expected));
  EXPECT_EQ(counters.majorantViolations, 0u);
  // What they are for: thin smoke is met by every ray.
  const double chance = 1 - expected;
  EXPECT_LT(weight.variance(n), 0.75 * chance * (1 - chance) + 1e-9);
  if (GetParam() < 1) {
    EXPECT_LT(weight.variance(n), 0.5 * chance * chance);
  }
}

INSTANTIATE_TEST_SUITE_P(Depths, ForcedCollisions, testing::Values(1e-6, 0.02, 0.5, 4.0, 40.0));

TEST(ForcedCollision, TransmittanceIsThatOfEachChannel) {
  const Rgb tint(1.0f, 0.5f, 0.2f);
  const Medium coloured = plume(3.0, tint), densest = plume(3.0);
  const auto depth = static_cast<double>(
      transport::marchOpticalDepth(densest, kOrigin, kDirection, kLength, 1e-3f));
  const int n = kSanitized ? 4000 : 60000;
  Mean channels[3], weight;
  transport::TrackingCounters counters;
  for (int i = 0; i < n; ++i) {
    Rng rng(RandomKey::fromSeed(4, 0), RandomStream::test, static_cast<std::uint64_t>(i));
    const auto all = transport::forceCollision<Rgb>(Rgb(1.0f), coloured, kOrigin, kDirection,
                                                    kLength, rng, counters);
    for (int c = 0; c < 3; ++c)
      channels[c].add(static_cast<double>(all.transmittance[c]));
    weight.add(static_cast<double>(all.weight));
  }
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(channels[c].mean(n), std::exp(-depth * static_cast<double>(tint[c])),
                4.5 * channels[c].error(n) + 1e-4)
        << c;
  EXPECT_NEAR(weight.mean(n), 1 - std::exp(-depth), 4.5 * weight.error(n) + 1e-4);
}

TEST(ForcedCollision, NothingIsMetWhereThereIsNothing) {
  const Medium medium = makeMedium(sampledVolume(
      1.0, 32, {0.9, 0.0, 5.0}, [](const Vec3d& p) { return p.x > 0.2 ? 1.0 : 0.0; }));
  Rng rng(RandomKey::fromSeed(1, 0), RandomStream::test, 0);
  transport::TrackingCounters counters;
  const auto all = transport::forceCollision<float>(Rgb(1.0f), medium, Vec3f(-0.4f, -0.5f, 0.0f),
                                                    Vec3f(0, 1, 0), 1.0f, rng, counters);
  EXPECT_FALSE(all.hit.happened());
  EXPECT_EQ(all.weight, 0.0f);
  EXPECT_EQ(all.transmittance, 1.0f);
}

}  // namespace

}  // namespace photosphere::test
