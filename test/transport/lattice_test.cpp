// The light lattice against a slow walk, and the sums of overlapping volumes.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "photosphere/core/sampling.h"
#include "photosphere/transport/support_lattice.h"
#include "photosphere/transport/tracking.h"
#include "support/media.h"

namespace photosphere::test {

namespace {

using transport::SupportLattice;

TEST(SupportLattice, CoversAllSmokeWithItsMargin) {
  const transport::Medium medium =
      makeMedium(sampledVolume(1.0, 48, {0.9, 0.0, 10.0}, plumeDensity));
  const SupportLattice lattice(medium, 0.04, 2);
  Rng rng(RandomKey::fromSeed(1, 0), RandomStream::test, 0);
  const Vec3f low(medium.bounds().min), extent(medium.bounds().extent());
  int smoky = 0;
  for (int i = 0; i < 50000; ++i) {
    const Vec3f p = low + extent * Vec3f(rng.uniform(), rng.uniform(), rng.uniform());
    if (!(medium.extinction(p) > 0)) continue;
    ++smoky;
    const Vec3i v(glm::floor((Vec3d(p) - lattice.origin()) / lattice.edge()));
    for (int z = -2; z <= 2; z += 2)
      for (int y = -2; y <= 2; y += 2)
        for (int x = -2; x <= 2; x += 2)
          ASSERT_GE(lattice.number(v + Vec3i(x, y, z)), 0);
  }
  EXPECT_GT(smoky, 2000);
  for (std::size_t i = 0; i < lattice.size(); ++i)
    ASSERT_EQ(lattice.number(lattice.voxel(i)), static_cast<std::int32_t>(i));
}

TEST(SupportLattice, AMarginIsThatOfEveryVoxel) {
  const transport::Medium medium =
      makeMedium(sampledVolume(1.0, 32, {0.9, 0.0, 10.0}, plumeDensity));
  const double edge = 1.0 / 64;  // origins differ by exact numbers
  const SupportLattice base(medium, edge, 0);
  ASSERT_GT(base.size(), 1000u);
  for (const int margin : {1, 2, 3}) {
    const SupportLattice lattice(medium, edge, margin);
    std::set<std::array<int, 3>> expected, found;
    for (std::size_t i = 0; i < base.size(); ++i)
      for (int z = 0; z <= 2 * margin; ++z)
        for (int y = 0; y <= 2 * margin; ++y)
          for (int x = 0; x <= 2 * margin; ++x)
            expected.insert({base.voxel(i).x + x, base.voxel(i).y + y, base.voxel(i).z + z});
    for (std::size_t i = 0; i < lattice.size(); ++i)
      found.insert({lattice.voxel(i).x, lattice.voxel(i).y, lattice.voxel(i).z});
    EXPECT_EQ(found.size(), lattice.size());
    EXPECT_EQ(found, expected) << margin;
  }
}

TEST(SupportLattice, WalkGivesEachVoxelItsLength) {
  const transport::Medium medium = makeMedium(boxVolume(Vec3d(1.0), Vec3i(16), {}));
  const SupportLattice lattice(medium, 0.11, 1);
  Rng rng(RandomKey::fromSeed(2, 0), RandomStream::test, 0);
  for (int i = 0; i < 200; ++i) {
    const Vec3f from = Vec3f(rng.uniform(), rng.uniform(), rng.uniform()) - 0.5f;
    const Vec3f d = i % 5 == 0 ? Vec3f(0, 0, -1) : sampleSphere(rng.uniform2());
    const float length = rng.uniform() * 0.9f;
    std::map<std::size_t, double> walked, sampled;
    double total = 0;
    lattice.walk(from, d, length, [&](std::size_t voxel, float, float part) {
      walked[voxel] += static_cast<double>(part);
      total += static_cast<double>(part);
    });
    constexpr int n = 4000;
    double inside = 0;
    for (int k = 0; k < n; ++k) {
      const Vec3f p = from + d * (length * (static_cast<float>(k) + 0.5f) / n);
      const std::int32_t v =
          lattice.number(Vec3i(glm::floor((Vec3d(p) - lattice.origin()) / lattice.edge())));
      if (v < 0) continue;
      sampled[static_cast<std::size_t>(v)] += static_cast<double>(length) / n;
      inside += static_cast<double>(length) / n;
    }
    EXPECT_NEAR(total, inside, 2e-3);
    for (const auto& entry : sampled)
      EXPECT_NEAR(walked[entry.first], entry.second, 1.5e-3);
  }
}

// Flights that are not finite, and lattices wider than floats tell voxels apart.
TEST(SupportLattice, WalkEndsWhateverTheNumbersAre) {
  const Vec3i bricks(1 << 22, 1, 1);
  const SupportLattice lattice(Vec3d(0.0), 1.0, bricks, {Vec3i(0, 4, 4), Vec3i(9, 4, 4)});
  const auto walked = [&](const Vec3f& from, const Vec3f& d, float length) {
    double sum = 0;
    lattice.walk(from, d, length,
                 [&](std::size_t, float, float part) { sum += static_cast<double>(part); });
    return sum;
  };
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  const Vec3f from(0.5f, 4.5f, 4.5f), along(1, 0, 0);
  EXPECT_EQ(walked(from, along, 20), 1.5);
  EXPECT_EQ(walked(from, along, 3e7f), 1.5);
  EXPECT_EQ(walked(from, Vec3f(kNone), kInfinity), 0.0);
  EXPECT_EQ(walked(from, Vec3f(1, kNone, 0), 20), 0.0);
  EXPECT_EQ(walked(Vec3f(kNone), along, 20), 0.0);
  EXPECT_EQ(walked(from, along, kInfinity), 0.0);
  EXPECT_EQ(walked(from, along, kNone), 0.0);
}

TEST(Medium, OverlappingVolumesAddUp) {
  std::vector<transport::MediumVolume> volumes;
  volumes.push_back(boxVolume(Vec3d(1.0), Vec3i(8), {0.5, 0.3, 2.0}));
  volumes.push_back(boxVolume(Vec3d(1.0), Vec3i(8), {0.9, 0.3, 1.0}));
  volumes.push_back(boxVolume(Vec3d(1.0), Vec3i(8), {1.0, -0.2, 4.0}));
  const transport::Medium medium(std::move(volumes));
  EXPECT_FLOAT_EQ(medium.extinction(Vec3f(0.1f)), 7.0f);
  ASSERT_EQ(medium.phases().size(), 2u);
  transport::Coefficients c;
  medium.coefficients(Vec3f(0.1f), c);
  EXPECT_FLOAT_EQ(c.extinction, 7.0f);
  EXPECT_NEAR(c.scattering[0].x, 1.9f, 1e-6f);
  EXPECT_NEAR(c.scattering[1].x, 4.0f, 1e-6f);
  EXPECT_GE(medium.majorants().maximum(), 7.0f);
}

TEST(Medium, HashesTellMediaApart) {
  const auto hashOf = [](double albedo, double g, double scale) {
    return makeMedium(boxVolume(Vec3d(1.0), Vec3i(8), {albedo, g, scale})).hash();
  };
  EXPECT_EQ(hashOf(0.9, 0.1, 2), hashOf(0.9, 0.1, 2));
  EXPECT_NE(hashOf(0.9, 0.1, 2), hashOf(0.8, 0.1, 2));
  EXPECT_NE(hashOf(0.9, 0.1, 2), hashOf(0.9, 0.2, 2));
  EXPECT_NE(hashOf(0.9, 0.1, 2), hashOf(0.9, 0.1, 3));
}

TEST(Tracking, MarchedOpticalDepthIsExactInABox) {
  const transport::Medium medium = makeMedium(boxVolume(Vec3d(2.0), Vec3i(16), {0.9, 0.0, 1.5}));
  const transport::Segment s = transport::clipToMedium(
      medium, Vec3d(-1e7, 0.3, 0.2), Vec3f(1, 0, 0), std::numeric_limits<double>::infinity());
  EXPECT_NEAR(s.length, 2.0f, 1e-5f);
  EXPECT_NEAR(transport::marchOpticalDepth(medium, s.origin, s.direction, s.length, 0.1f), 3.0f,
              1e-4f);
}

}  // namespace

}  // namespace photosphere::test
