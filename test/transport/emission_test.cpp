// Light born in the smoke: its power, where photons start, and what becomes of them.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "photosphere/transport/tracking.h"
#include "support/media.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using transport::Emission;

// Uneven in space and colour, zero on one side, never constant over a brick.
Rgb unevenGlow(const Vec3d& p) {
  const double body = std::max(0.0, p.x + 0.1) * (1.2 + std::sin(9 * p.y)) * (0.6 - p.z);
  return Rgb(Vec3d(body, 0.5 * body * (0.5 + p.y), 0.1));
}

transport::Medium glowingMedium(const std::function<Rgb(const Vec3d&)>& j, double albedo,
                                double extinction) {
  transport::MediumVolume v = sampledVolume(1.0, 16, {albedo, 0.3, extinction}, plumeDensity);
  v.emission = sampledEmission(1.0, 16, j);
  return makeMedium(std::move(v));
}

TEST(Emission, PowerIsFourPiTimesTheIntegral) {
  // A trilinear field is integrated exactly: here x + 1/2 in red, a constant in green.
  const transport::Medium medium =
      glowingMedium([](const Vec3d& p) { return Rgb(Vec3d(p.x + 0.5, 0.25, 0)); }, 0.5, 1.0);
  const Emission& emission = *medium.emission();
  EXPECT_NEAR(emission.power().x, 4 * kPi * 0.5, 1e-5);
  EXPECT_NEAR(emission.power().y, 4 * kPi * 0.25, 1e-5);
  EXPECT_EQ(emission.power().z, 0.0);
  EXPECT_GE(emission.birthPower(), maxComponent(emission.power()));
  EXPECT_FALSE(emission.isGrey());
}

// Births fill space as the interpolated emission does, in every channel, and no photon carries
// more than the shared power.
TEST(Emission, BirthsFollowTheInterpolatedEmission) {
  const transport::Medium medium = glowingMedium(unevenGlow, 0.5, 1.0);
  const Emission& emission = *medium.emission();
  constexpr int kCells = 6;
  const int count = kSanitized ? 20'000 : 400'000;
  struct Cell {
    double born = 0;
    Vec3d power{0.0}, expected{0.0}, square{0.0};
  };
  std::vector<Cell> cells(kCells * kCells * kCells);
  const auto cellAt = [&](const Vec3d& p) -> Cell& {
    const Vec3i c = glm::clamp(Vec3i(glm::floor((p + 0.5) * double(kCells))), 0, kCells - 1);
    return cells[static_cast<std::size_t>((c.z * kCells + c.y) * kCells + c.x)];
  };
  Rng rng(RandomKey::fromSeed(2, 0), RandomStream::test, 0);
  for (int i = 0; i < count; ++i) {
    const double u = rng.uniformDouble();
    const Emission::Birth birth =
        emission.birth(u, Vec3f(rng.uniform(), rng.uniform(), rng.uniform()));
    ASSERT_LE(maxComponent(birth.power), static_cast<float>(emission.birthPower()) * 1.00001f);
    Cell& cell = cellAt(Vec3d(birth.origin));
    cell.born += 1;
    cell.power += Vec3d(birth.power) / double(count);
    cell.square += Vec3d(birth.power) * Vec3d(birth.power);
  }
  // The midpoint rule on 96 points an axis, six to a cell of the lattice.
  constexpr int kFine = 96;
  for (int z = 0; z < kFine; ++z)
    for (int y = 0; y < kFine; ++y)
      for (int x = 0; x < kFine; ++x) {
        const Vec3d p = (Vec3d(x, y, z) + 0.5) / double(kFine) - 0.5;
        cellAt(p).expected += 4 * kPi * Vec3d(emission.at(Vec3f(p))) / std::pow(double(kFine), 3);
      }
  double statistic = 0;
  int terms = 0;
  for (const Cell& cell : cells)
    for (int c = 0; c < 3; ++c) {
      if (cell.born < 40) continue;
      const double variance = cell.square[c] / count / count;
      if (!(variance > 0)) continue;
      statistic += std::pow(cell.power[c] - cell.expected[c], 2) / variance;
      ++terms;
    }
  ASSERT_GT(terms, 300);
  // Mean 1; the three channels of a cell share births, so about 200 are independent.
  EXPECT_NEAR(statistic / terms, 1.0, 0.3);
}

struct Tally final : transport::FlightSink {
  void consume(std::span<const transport::Flight> flights) override {
    for (const transport::Flight& f : flights)
      if (f.light == transport::kEmittedBySmoke && f.scatterings == 0) ++firstFlights;
  }
  std::atomic<std::uint64_t> firstFlights{0};
};

TEST(Emission, PhotonsShareThePowerWithLampsAndLoseNone) {
  const transport::Medium medium = glowingMedium(unevenGlow, 0.8, 20.0);
  transport::LightList lights;
  const auto traced = [&](Tally& tally) {
    transport::TraceOptions options;
    options.photons = 40'000;
    options.key = RandomKey::fromSeed(1, 0);
    return transport::tracePhotons(medium, lights, options, tally);
  };
  Tally alone;
  const transport::TraceStatistics only = traced(alone);
  EXPECT_EQ(only.born, only.photons);
  EXPECT_EQ(alone.firstFlights, only.born);
  EXPECT_EQ(only.missed, Vec3d(0.0));
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(only.emitted[c], medium.emission()->power()[c],
                0.01 * medium.emission()->power()[c]);
    EXPECT_NEAR(only.imbalance()[c], 0, 1e-7 * only.emitted[c]);
    EXPECT_GT(only.absorbed[c], 0.02 * only.emitted[c]);
    EXPECT_GT(only.escaped[c], 0.1 * only.emitted[c]);
  }

  lights.push_back(makeLight("spot", {{"position", "[2, -1, 2]"}, {"intensity", "3"}}));
  const double lamp = maxComponent(Vec3d(lights[0]->power(boundingSphere(medium))));
  Tally both;
  const transport::TraceStatistics shared = traced(both);
  const double share = medium.emission()->birthPower() / (medium.emission()->birthPower() + lamp);
  ASSERT_GT(share, 0.1);
  ASSERT_LT(share, 0.9);
  EXPECT_NEAR(static_cast<double>(shared.born) / static_cast<double>(shared.photons), share, 1e-3);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(shared.emitted[c], medium.emission()->power()[c] + lamp, 0.01 * shared.emitted[c]);
    EXPECT_NEAR(shared.imbalance()[c], 0, 1e-7 * shared.emitted[c]);
  }
}

TEST(Emission, NoneWhereNothingEmits) {
  const transport::Medium medium =
      makeMedium(sampledVolume(1.0, 16, {0.9, 0.3, 5.0}, plumeDensity));
  EXPECT_EQ(medium.emission(), nullptr);
  // A field of zeros is none either.
  EXPECT_EQ(glowingMedium([](const Vec3d&) { return Rgb(0.0f); }, 0.9, 5.0).emission(), nullptr);
  EXPECT_NE(medium.hash(), glowingMedium([](const Vec3d&) { return Rgb(1.0f); }, 0.9, 5.0).hash());
}

// A flame beside the smoke: rays must walk through it and its cells must be known.
TEST(Emission, BoundsHoldAFlameOutsideTheSmoke) {
  transport::MediumVolume v = sampledVolume(1.0, 16, {0.9, 0.0, 5.0}, [](const Vec3d& p) {
    return p.x > 0.2 && p.x < 0.4 && std::abs(p.y) < 0.3 ? 1.0 : 0.0;
  });
  v.emission = sampledEmission(2.0, 16, [](const Vec3d& p) {
    return std::abs(p.x + 0.75) < 0.13 && std::abs(p.z) < 0.2 ? Rgb(1.0f) : Rgb(0.0f);
  });
  const transport::Medium medium = makeMedium(std::move(v));
  EXPECT_LT(medium.bounds().min.x, -0.8);
  EXPECT_GT(medium.bounds().max.x, 0.39);
  const Emission& emission = *medium.emission();
  Rng rng(RandomKey::fromSeed(5, 0), RandomStream::test, 0);
  double glow = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3f low(medium.bounds().min), extent(medium.bounds().extent());
    const Vec3f p = low + extent * Vec3f(rng.uniform(), rng.uniform(), rng.uniform());
    const Vec3f d = glm::normalize(Vec3f(rng.uniform(), rng.uniform(), rng.uniform()) - 0.5f);
    for (volume::MajorantGrid::Walk walk(medium.majorants(), p, d, 0.0f, kInfinity); !walk.done();
         walk.advance()) {
      const float middle = 0.5f * (walk.begin() + walk.end());
      const float here = emission.at(p + d * middle).x;
      glow += static_cast<double>(here);
      if (!emission.inCell(walk.cell())) {
        ASSERT_LE(here, 1e-5f);
      }
    }
  }
  EXPECT_GT(glow, 10.0);
}

}  // namespace

}  // namespace photosphere::test
