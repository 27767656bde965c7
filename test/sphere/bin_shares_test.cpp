// Which bins take the light of a direction: sums, exact cases, symmetry, and what it costs to read
// the light back.
#include "photosphere/sphere/bin_shares.h"

#include <cmath>
#include <map>

#include "photosphere/core/error.h"
#include "photosphere/core/rng.h"
#include "photosphere/core/sampling.h"
#include "photosphere/sphere/bin_weights.h"
#include "support/support.h"

namespace photosphere::sphere {
namespace {

std::map<int, float> sharesOf(const BinShares& deposit, const Vec3f& w) {
  std::vector<BinShare> out(static_cast<std::size_t>(deposit.maxShares()));
  const int count = deposit.shares(w, out.data());
  std::map<int, float> shares;
  for (int i = 0; i < count; ++i)
    shares[out[static_cast<std::size_t>(i)].bin] += out[static_cast<std::size_t>(i)].weight;
  EXPECT_EQ(shares.size(), static_cast<std::size_t>(count)) << "a bin is named twice";
  return shares;
}

BinShares make(int rows, DirectionDeposit deposit) {
  return BinShares(Partition(rows), deposit, {AngularKernel::gaussian, 0.4, 3});
}

struct Setting {
  int rows;
  DirectionDeposit deposit;
};
class Shares : public ::testing::TestWithParam<Setting> {};

TEST_P(Shares, AreNotNegativeAndSumToOne) {
  const BinShares deposit = make(GetParam().rows, GetParam().deposit);
  Rng rng(RandomKey::fromSeed(1, 0), RandomStream::test, 0);
  std::vector<Vec3f> directions{{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, -1, 0}, {-0.0f, 1, -0.0f}};
  for (int i = 0; i < 20000; ++i)
    directions.push_back(sampleSphere(rng.uniform2()));
  for (const Vec3f& w : directions) {
    float sum = 0;
    for (const auto& share : sharesOf(deposit, w)) {
      ASSERT_GT(share.second, 0.0f);
      ASSERT_GE(share.first, 0);
      ASSERT_LT(share.first, deposit.partition().size());
      sum += share.second;
    }
    ASSERT_NEAR(sum, 1.0f, 2e-6f);
  }
  EXPECT_EQ(sharesOf(deposit, Vec3f(0)), sharesOf(deposit, Vec3f(0, 0, 1)));
}

// Mirroring a direction mirrors its shares: what the tables of BinWeights rest on.
TEST_P(Shares, MirrorLikeThePartition) {
  const BinShares deposit = make(GetParam().rows, GetParam().deposit);
  const Partition& bins = deposit.partition();
  const int cells = bins.size() / 8;
  Rng rng(RandomKey::fromSeed(2, 0), RandomStream::test, 0);
  for (int i = 0; i < 500; ++i) {
    const Vec3f w = sampleSphere(rng.uniform2());
    const auto shares = sharesOf(deposit, w);
    for (int flip = 1; flip < 8; ++flip) {
      const Vec3f m(flip & 1 ? -w.x : w.x, flip & 2 ? -w.y : w.y, flip & 4 ? -w.z : w.z);
      for (const auto& share : sharesOf(deposit, m)) {
        const auto it =
            shares.find((bins.octant(share.first) ^ flip) * cells + bins.mirrored(share.first));
        ASSERT_TRUE(it != shares.end());
        ASSERT_NEAR(it->second, share.second, 1e-6f);
      }
    }
  }
}

// Even light goes to all bins alike on the whole, and light lands near where it came from.
TEST_P(Shares, StayNearTheirDirection) {
  const BinShares deposit = make(GetParam().rows, GetParam().deposit);
  const Partition& bins = deposit.partition();
  const double spacing = std::sqrt(4 * kPi / bins.size());
  const double reach = GetParam().deposit == DirectionDeposit::kernel ? 0.4 * 3 : 2.0 * spacing;
  Rng rng(RandomKey::fromSeed(3, 0), RandomStream::test, 0);
  for (int i = 0; i < 5000; ++i) {
    const Vec3f w = sampleSphere(rng.uniform2());
    for (const auto& share : sharesOf(deposit, w))
      ASSERT_LT(static_cast<double>(angleBetween(w, bins.center(share.first))),
                std::max(reach, spacing));
  }
}

INSTANTIATE_TEST_SUITE_P(Sphere, Shares,
                         ::testing::Values(Setting{1, DirectionDeposit::nearest},
                                           Setting{3, DirectionDeposit::nearest},
                                           Setting{1, DirectionDeposit::barycentric},
                                           Setting{2, DirectionDeposit::barycentric},
                                           Setting{3, DirectionDeposit::barycentric},
                                           Setting{5, DirectionDeposit::barycentric},
                                           Setting{16, DirectionDeposit::barycentric},
                                           Setting{2, DirectionDeposit::kernel},
                                           Setting{4, DirectionDeposit::kernel}));

TEST(Barycentric, GivesABinAllAtItsCentre) {
  for (const int rows : {1, 2, 3, 4, 7}) {
    const BinShares deposit = make(rows, DirectionDeposit::barycentric);
    for (int bin = 0; bin < deposit.partition().size(); ++bin) {
      const auto shares = sharesOf(deposit, deposit.partition().center(bin));
      const auto own = shares.find(bin);
      ASSERT_TRUE(own != shares.end());
      ASSERT_NEAR(own->second, 1.0f, 2e-5f) << rows << ' ' << bin;
    }
  }
}

// Barycentric coordinates give back the direction: the corners' mean lies along it.
TEST(Barycentric, SurroundsTheDirection) {
  for (const int rows : {1, 2, 3, 6}) {
    const BinShares deposit = make(rows, DirectionDeposit::barycentric);
    Rng rng(RandomKey::fromSeed(4, 0), RandomStream::test, 0);
    for (int i = 0; i < 5000; ++i) {
      const Vec3f w = sampleSphere(rng.uniform2());
      Vec3f mean(0.0f);
      const auto shares = sharesOf(deposit, w);
      for (const auto& share : shares)
        mean += share.second * deposit.partition().center(share.first);
      ASSERT_LT(angleBetween(glm::normalize(mean), w), 2e-6f * static_cast<float>(rows) + 4e-6f);
    }
  }
}

TEST(Barycentric, IsContinuous) {
  for (const int rows : {1, 2, 4}) {
    const BinShares deposit = make(rows, DirectionDeposit::barycentric);
    Rng rng(RandomKey::fromSeed(5, 0), RandomStream::test, 0);
    for (int i = 0; i < 4000; ++i) {
      // Great circles through the planes of symmetry and all over the sphere.
      Vec3f w = sampleSphere(rng.uniform2());
      if (i % 4 < 3) w[i % 4] = 0.0f;
      w = glm::normalize(w);
      const Vec3f v = glm::normalize(w + 1e-4f * sampleSphere(rng.uniform2()));
      auto a = sharesOf(deposit, w), b = sharesOf(deposit, v);
      float difference = 0;
      for (int bin = 0; bin < deposit.partition().size(); ++bin)
        difference += std::abs(a[bin] - b[bin]);
      ASSERT_LT(difference, 1e-3f * static_cast<float>(rows));
    }
  }
}

TEST(KernelDeposit, NeedsAKernel) {
  EXPECT_THROW(BinShares(Partition(2), DirectionDeposit::kernel), ConfigError);
  const BinShares narrow(Partition(2), DirectionDeposit::kernel,
                         {AngularKernel::epanechnikov, 0.001, 1});
  const Vec3f w = narrow.partition().point(7, {0.1, 0.1});
  EXPECT_EQ(sharesOf(narrow, w), (std::map<int, float>{{7, 1.0f}}));
}

double henyeyGreenstein(double g, double cosine) {
  return (1 - g * g) / (4 * kPi * std::pow(1 + g * g - 2 * g * cosine, 1.5));
}

// Root mean square error, over directions, of light scattered from a lobe of mean cosine 0.6 that
// was deposited and read back; relative to the mean 1 / (4 pi). Lobes convolve to a lobe.
double scatteredError(const BinShares& deposit, Reconstruction reconstruction, double g) {
  const BinWeights weights(
      deposit,
      [g](const Vec3f& w, const Vec3f& wo) {
        return henyeyGreenstein(g, static_cast<double>(glm::dot(w, wo)));
      },
      g, reconstruction);
  const Vec3f axis = glm::normalize(Vec3f(0.3f, -0.5f, 0.8f));
  std::vector<double> light(static_cast<std::size_t>(weights.size()), 0.0);
  const Partition points(48);
  for (int i = 0; i < points.size(); ++i) {
    const Vec3f w = points.center(i);
    for (const auto& share : sharesOf(deposit, w))
      light[static_cast<std::size_t>(share.first)] +=
          static_cast<double>(share.second * points.cellArea()) *
          henyeyGreenstein(0.6, static_cast<double>(glm::dot(w, axis)));
  }
  std::vector<float> w(light.size());
  const Partition directions(5);
  double sum = 0, total = 0;
  for (int i = 0; i < directions.size(); ++i) {
    const Vec3f wo = directions.center(i);
    weights.weights(wo, w.data());
    double value = 0;
    for (std::size_t j = 0; j < w.size(); ++j)
      value += static_cast<double>(w[j]) * light[j];
    const double d = value - henyeyGreenstein(g * 0.6, static_cast<double>(glm::dot(wo, axis)));
    sum += d * d;
    total += value * static_cast<double>(directions.cellArea());
  }
  EXPECT_NEAR(total, 1.0, 0.01) << "energy";
  return std::sqrt(sum / directions.size()) * 4 * kPi;
}

TEST(DepositedLight, ReadsBackWithItsEnergy) {
  for (const int rows : {1, 2, 3})
    for (const double g : {0.3, 0.7}) {
      double error[3][2];
      for (const DirectionDeposit deposit :
           {DirectionDeposit::nearest, DirectionDeposit::barycentric, DirectionDeposit::kernel})
        for (const Reconstruction r : {Reconstruction::constant, Reconstruction::smooth})
          error[static_cast<int>(deposit)][static_cast<int>(r)] =
              scatteredError(make(rows, deposit), r, g);
      std::printf("  %d rows, g %.1f: nearest %.4f %.4f, barycentric %.4f %.4f, kernel %.4f %.4f\n",
                  rows, g, error[0][0], error[0][1], error[1][0], error[1][1], error[2][0],
                  error[2][1]);
      if (rows == 1) continue;  // eight bins are too few for a shape
      for (const auto& row : error)
        EXPECT_LT(row[1], row[0]) << "the smooth reconstruction undoes part of the spreading";
    }
}

// With an isotropic phase function no deposit can be told from another.
TEST(DepositedLight, IsotropicLimitIsTheSame) {
  for (const DirectionDeposit deposit :
       {DirectionDeposit::nearest, DirectionDeposit::barycentric, DirectionDeposit::kernel})
    for (const Reconstruction r : {Reconstruction::constant, Reconstruction::smooth}) {
      const BinWeights weights(
          make(2, deposit), [](const Vec3f&, const Vec3f&) { return 1 / (4 * kPi); }, 0, r);
      std::vector<float> w(32);
      weights.weights(glm::normalize(Vec3f(1, -2, 3)), w.data());
      for (const float x : w)
        EXPECT_NEAR(x, 1 / (4 * kPi), 1e-7);
    }
}

}  // namespace
}  // namespace photosphere::sphere
