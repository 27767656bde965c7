// Lookups among photons against slow sums over all of them, and what they keep of the energy.

#include "photosphere/estimators/photon_set.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "photosphere/core/rng.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using estimators::Lobe;
using estimators::PhotonColumns;
using estimators::PhotonSet;
using estimators::SpatialKernel;

constexpr SpatialKernel kKernels[] = {SpatialKernel::epanechnikov, SpatialKernel::box,
                                      SpatialKernel::gaussian};
constexpr int kPhotons = kSanitized ? 300 : 4000;

Vec3f randomPoint(Rng& rng) {
  const float x = rng.uniform(), y = rng.uniform();
  return {x, y, rng.uniform()};
}

Vec3f randomDirection(Rng& rng) {
  const float z = 2 * rng.uniform() - 1;
  const SinCos phi = fastSinCosTurns(rng.uniform());
  const float s = std::sqrt(std::max(0.0f, 1 - z * z));
  return {s * phi.cos, s * phi.sin, z};
}

// Photons at positions that `place` gives, of random directions and powers.
PhotonColumns makePhotons(int count, int channels, const std::function<Vec3f(int, Rng&)>& place) {
  PhotonColumns photons(static_cast<std::size_t>(count), channels);
  Rng rng(RandomKey::fromSeed(11, 0), RandomStream::test, 0);
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const Vec3f p = place(i, rng), d = randomDirection(rng);
    for (int a = 0; a < 3; ++a) {
      photons.position[static_cast<std::size_t>(a)][at] = p[a];
      photons.direction[static_cast<std::size_t>(a)][at] = d[a];
      if (a < channels)
        photons.power[static_cast<std::size_t>(a)][at] = 0.5f + rng.uniform() + float(a);
    }
  }
  return photons;
}

double kernelAt(SpatialKernel kernel, double t) {
  if (t > 1) return 0;
  if (kernel == SpatialKernel::box) return 1;
  return kernel == SpatialKernel::epanechnikov ? 1 - t : std::exp(-4.5 * t);
}

// Eq. 6 with a normalised kernel, over every photon, in double.
Vec3d slowSum(const PhotonColumns& photons, SpatialKernel kernel, double radius, const Vec3f& p,
              const Vec3f& wo, const Lobe& lobe) {
  Vec3d sum(0.0);
  for (std::size_t i = 0; i < photons.count; ++i) {
    const double distance = glm::length(Vec3d(photons.positionOf(i)) - Vec3d(p));
    const double w = kernelAt(kernel, distance * distance / (radius * radius));
    sum += w * static_cast<double>(lobe.evaluate(photons.directionOf(i), wo)) *
           Vec3d(photons.powerOf(i));
  }
  return sum / estimators::kernelVolume(kernel, radius);
}

struct Cloud {
  const char* name;
  int count;
  std::function<Vec3f(int, Rng&)> place;
};

std::vector<Cloud> clouds() {
  return {{"uniform", kPhotons, [](int, Rng& rng) { return randomPoint(rng); }},
          {"dense in a corner", kPhotons,
           [](int i, Rng& rng) { return randomPoint(rng) * (i % 5 ? 0.05f : 1.0f); }},
          // Cells of a grid whose edge divides these positions have photons on their faces.
          {"on a lattice", kPhotons,
           [](int, Rng& rng) { return glm::floor(randomPoint(rng) * 12.0f) * (0.1f / 3.0f); }},
          {"in a plane", kPhotons,
           [](int, Rng& rng) {
             const Vec3f p = randomPoint(rng);
             return Vec3f(p.x, p.y, 0.25f);
           }},
          {"all at one point", 100, [](int, Rng&) { return Vec3f(0.25f); }},
          {"far from the origin", kPhotons,
           [](int, Rng& rng) { return randomPoint(rng) + Vec3f(500, -300, 80); }},
          {"one", 1, [](int, Rng&) { return Vec3f(0.3f); }},
          {"none", 0, [](int, Rng&) { return Vec3f(0.0f); }}};
}

// Points to ask about: near photons, on photons, and off the cloud.
std::vector<Vec3f> queries(const PhotonColumns& photons) {
  std::vector<Vec3f> points{Vec3f(-3.0f), Vec3f(1e6f)};
  Rng rng(RandomKey::fromSeed(12, 0), RandomStream::test, 0);
  for (int i = 0; i < 40; ++i) {
    const std::size_t at = photons.count ? static_cast<std::size_t>(rng.bits()) % photons.count : 0;
    const Vec3f p = photons.count ? photons.positionOf(at) : Vec3f(0.5f);
    points.push_back(i % 3 == 0 ? p : p + 0.2f * (randomPoint(rng) - 0.5f));
  }
  return points;
}

void expectNear(const Rgb& fast, const Vec3d& slow, double absolute, const std::string& what) {
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(static_cast<double>(fast[c]), slow[c], 1e-3 * slow[c] + absolute)
        << what << ", channel " << c;
}

TEST(PhotonSetTest, FixedRadiusIsTheSumOverAllPhotons) {
  const Lobe lobes[] = {{phase::HenyeyGreenstein(0.6), nullptr},
                        estimators::tabulatedLobe(
                            phase::HenyeyGreenstein(0.6),
                            sphere::SmoothingKernel(sphere::AngularKernel::gaussian, 0.5, 3.0))};
  const Vec3f wo = glm::normalize(Vec3f(0.3f, -0.5f, 0.8f));
  for (const Cloud& cloud : clouds())
    for (const int channels : {1, 3})
      for (const SpatialKernel kernel : kKernels)
        for (const double radius : {1e-4, 0.1, 0.37, 4000.0}) {
          const PhotonColumns photons = makePhotons(cloud.count, channels, cloud.place);
          const auto set = makeFixedRadiusSet(photons, kernel, radius);
          const Lobe& lobe = lobes[channels == 1];
          ASSERT_EQ(set->photons().count, photons.count);
          for (const Vec3f& p : queries(photons)) {
            // Photons at the ball's surface to rounding may fall on either side of it.
            const Vec3d inner = slowSum(photons, kernel, radius * (1 - 2e-4), p, wo, lobe);
            const Vec3d outer = slowSum(photons, kernel, radius * (1 + 2e-4), p, wo, lobe);
            const Rgb fast = set->scattered(p, wo, lobe);
            for (int c = 0; c < 3; ++c) {
              EXPECT_GE(static_cast<double>(fast[c]), inner[c] * (1 - 2e-3) - 1e-12)
                  << cloud.name << ", radius " << radius;
              EXPECT_LE(static_cast<double>(fast[c]), outer[c] * (1 + 2e-3) + 1e-12)
                  << cloud.name << ", radius " << radius;
            }
          }
        }
}

// Counts to the last photon: with a box, even directions and unit power the answer is a whole
// number.
TEST(PhotonSetTest, FixedRadiusMissesNoPhoton) {
  const Lobe lobe{phase::HenyeyGreenstein(0.0), nullptr};
  for (const Cloud& cloud : clouds())
    for (const float radius : {0.1f, 0.25f, 1.0f}) {
      PhotonColumns photons = makePhotons(cloud.count, 1, cloud.place);
      std::fill(photons.power[0].begin(), photons.power[0].end(), 1.0f);
      const auto set = makeFixedRadiusSet(photons, SpatialKernel::box, static_cast<double>(radius));
      const double volume =
          estimators::kernelVolume(SpatialKernel::box, static_cast<double>(radius));
      for (const Vec3f& p : queries(photons)) {
        int count = 0;
        for (std::size_t i = 0; i < photons.count; ++i) {
          const Vec3f d = photons.positionOf(i) - p;
          count += (d.x * d.x + d.y * d.y + d.z * d.z) * (1.0f / (radius * radius)) <= 1.0f;
        }
        const double fast =
            static_cast<double>(set->scattered(p, {0, 0, 1}, lobe).x) * volume * 4 * kPi;
        EXPECT_NEAR(fast, count, 1e-3 + 1e-5 * count) << cloud.name << ", radius " << radius;
      }
    }
}

// The ball of the k nearest ends at the next photon.
TEST(PhotonSetTest, NearestAreThoseOfASortedList) {
  const Lobe lobe{phase::HenyeyGreenstein(-0.4), nullptr};
  const Vec3f wo = glm::normalize(Vec3f(-0.3f, 0.5f, 0.2f));
  const double limit = 0.3;
  int limited = 0, ended = 0;
  for (const Cloud& cloud : clouds())
    for (const std::uint32_t k : {1u, 7u, 50u, 100'000u}) {
      const PhotonColumns photons = makePhotons(cloud.count, 1, cloud.place);
      const auto set = makeNearestSet(photons, SpatialKernel::epanechnikov, k, limit);
      for (const Vec3f& p : queries(photons)) {
        std::vector<double> distances;
        for (std::size_t i = 0; i < photons.count; ++i)
          distances.push_back(glm::length(Vec3d(photons.positionOf(i) - p)));
        std::sort(distances.begin(), distances.end());
        const double next = k < distances.size() ? distances[k] : limit;
        if (next < 1e-3 * limit) {
          // More than k photons at one point: which of them count is open, the answer stays finite.
          EXPECT_LT(maxComponent(set->scattered(p, wo, lobe)), kInfinity) << cloud.name;
          continue;
        }
        const double radius = std::min(next, limit);
        // Of photons at the very end of the ball, whose weight is nothing up to rounding.
        const double absolute = 1e-6 * static_cast<double>(photons.count) /
                                estimators::kernelVolume(SpatialKernel::epanechnikov, radius);
        next < limit ? ++ended : ++limited;
        expectNear(set->scattered(p, wo, lobe),
                   slowSum(photons, SpatialKernel::epanechnikov, radius, p, wo, lobe), absolute,
                   cloud.name + fmt::format(", k {}", k));
      }
    }
  EXPECT_GT(limited, 100);
  EXPECT_GT(ended, 100);
}

// The photon that ends the ball is left out: without that the mean would be (k + 1) / k too large.
TEST(PhotonSetTest, NearestEstimateTheDensityWithoutBias) {
  const RunOnly runOnly;
  const int count = 60'000;
  const std::uint32_t k = 5;
  PhotonColumns photons = makePhotons(count, 1, [](int, Rng& rng) { return randomPoint(rng); });
  std::fill(photons.power[0].begin(), photons.power[0].end(), 1.0f);
  const Lobe even{phase::HenyeyGreenstein(0.0), nullptr};
  for (const SpatialKernel kernel : kKernels) {
    const auto set = makeNearestSet(photons, kernel, k, 0.5);
    Rng rng(RandomKey::fromSeed(13, 0), RandomStream::test, 0);
    const int lookups = static_cast<int>(fewer(20'000));
    double sum = 0;
    for (int i = 0; i < lookups; ++i)
      sum += static_cast<double>(set->scattered(0.2f + 0.6f * randomPoint(rng), {0, 0, 1}, even).x);
    EXPECT_NEAR(sum / lookups * 4 * kPi / count, 1.0, 0.03);
  }
}

// Over all of space and all directions a lookup gives back each photon's power.
TEST(PhotonSetTest, LookupsKeepTheEnergy) {
  const PhotonColumns photons = makePhotons(1, 3, [](int, Rng&) { return Vec3f(0.1f); });
  const double radius = 0.5;
  const int points = kSanitized ? 20'000 : 200'000;
  for (const SpatialKernel kernel : kKernels)
    for (const Lobe& lobe :
         {Lobe{phase::HenyeyGreenstein(0.5), nullptr},
          estimators::tabulatedLobe(
              phase::HenyeyGreenstein(0.5),
              sphere::SmoothingKernel(sphere::AngularKernel::gaussian, 0.4, 3.0))}) {
      const std::unique_ptr<PhotonSet> set = makeFixedRadiusSet(photons, kernel, radius);
      Rng rng(RandomKey::fromSeed(14, 0), RandomStream::test, 0);
      Vec3d sum(0.0);
      for (int i = 0; i < points; ++i) {
        const Vec3f p = 0.1f + (randomPoint(rng) - 0.5f);
        sum += Vec3d(set->scattered(p, randomDirection(rng), lobe));
      }
      const Vec3d ratio = sum / double(points) * 4.0 * kPi / Vec3d(photons.powerOf(0));
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(ratio[c], 1.0, kSanitized ? 0.1 : 0.03);
    }
}

}  // namespace

}  // namespace photosphere::test
