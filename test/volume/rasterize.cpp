// Particles to density and back: mass is kept, and threads change no bit.
#include "photosphere/volume/rasterize.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "openvdb_instances.h"
#include "photosphere/core/error.h"
#include "photosphere/core/parallel.h"
#include "photosphere/core/rng.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::volume {
namespace {

Rng testRng(std::uint64_t index) {
  return Rng(RandomKey::fromSeed(11, 0), RandomStream::test, index);
}

const openvdb::FloatGrid& floats(const Grid& grid) {
  return dynamic_cast<const openvdb::FloatGrid&>(*grid.base());
}

ParticleSet randomSet(std::size_t count, const Vec3d& origin, std::uint64_t index) {
  Rng rng = testRng(index);
  ParticleSet set;
  std::vector<float> pscale, mass;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = rng.uniformDouble(), y = rng.uniformDouble(), z = rng.uniformDouble();
    set.positions.push_back(origin + Vec3d(x, y, z));
    pscale.push_back(0.001f + 0.1f * rng.uniform());
    mass.push_back(rng.uniform());
  }
  set.add({"pscale", 1, pscale});
  set.add({"mass", 1, mass});
  return set;
}

// The definition, particle by particle and voxel by voxel, in a map.
std::map<std::array<int, 3>, double> oracle(const ParticleSet& set, double voxel) {
  std::map<std::array<int, 3>, double> voxels;
  for (std::size_t i = 0; i < set.size(); ++i) {
    const Vec3d c = set.positions[i] / voxel;
    const double r = set.find("pscale")->number(i) / voxel, m = set.find("mass")->number(i);
    std::vector<std::pair<std::array<int, 3>, double>> weights;
    double sum = 0;
    const int reach = static_cast<int>(std::ceil(r)) + 1;
    const Vec3i middle(glm::round(c));
    for (int x = -reach; x <= reach; ++x)
      for (int y = -reach; y <= reach; ++y)
        for (int z = -reach; z <= reach; ++z) {
          const Vec3i at = middle + Vec3i(x, y, z);
          const double d = glm::length(Vec3d(at) - c);
          if (!(d < r)) continue;
          weights.push_back({{at.x, at.y, at.z}, 1 - d * d / (r * r)});
          sum += weights.back().second;
        }
    if (weights.empty()) voxels[{middle.x, middle.y, middle.z}] += m;
    for (const auto& [at, w] : weights)
      voxels[at] += m * w / sum;
  }
  for (auto& [at, mass] : voxels)
    mass /= voxel * voxel * voxel;
  return voxels;
}

TEST(Rasterize, AgreesWithTheDefinition) {
  const ParticleSet set = randomSet(300, Vec3d(-0.5), 1);
  const double voxel = 0.03;
  const RasterizeResult result = rasterize(set, {voxel, 0});
  const auto expected = oracle(set, voxel);
  EXPECT_EQ(result.density.activeVoxels(), expected.size());
  const auto accessor = floats(result.density).getConstAccessor();
  double worst = 0;
  for (const auto& [at, density] : expected) {
    const double got = accessor.getValue(openvdb::Coord(at[0], at[1], at[2]));
    worst = std::max(worst, std::abs(got - density) / density);
  }
  EXPECT_LT(worst, 1e-6);
}

TEST(Rasterize, KeepsTheMassForAnyRadius) {
  for (const double radius : {0.0, 0.004, 0.02, 0.3}) {
    const ParticleSet set = randomSet(500, Vec3d(0), 2);
    const RasterizeResult result = rasterize(set, {0.02, radius});
    EXPECT_GT(result.massParticles, 0);
    EXPECT_NEAR(result.massGrid / result.massParticles, 1, 1e-6) << radius;
    const double mass = statistics(result.density).mean *
                        static_cast<double>(result.density.activeVoxels()) * std::pow(0.02, 3);
    EXPECT_NEAR(mass / result.massParticles, 1, 1e-6) << radius;
  }
}

TEST(Rasterize, ThreadsChangeNoBit) {
  const ParticleSet set = randomSet(20000, Vec3d(0), 3);
  std::vector<std::vector<float>> values;
  for (const unsigned threads : {1u, 2u, 3u}) {
    const ThreadLimit limit(threads);
    const RasterizeResult result = rasterize(set, {});
    std::vector<float> all;
    for (auto it = floats(result.density).cbeginValueOn(); it; ++it)
      all.push_back(*it);
    values.push_back(std::move(all));
  }
  EXPECT_EQ(values[0], values[1]);
  EXPECT_EQ(values[0], values[2]);
}

TEST(Rasterize, SkipsAndCountsWhatIsNotANumber) {
  ParticleSet set = randomSet(8, Vec3d(0), 4);
  auto& pscale = std::get<std::vector<float>>(set.find("pscale")->data);
  auto& mass = std::get<std::vector<float>>(set.find("mass")->data);
  set.positions[0].x = std::nan("");
  set.positions[1].z = std::numeric_limits<double>::infinity();
  pscale[2] = std::nanf("");
  pscale[3] = -1;
  mass[4] = -1;
  mass[5] = std::numeric_limits<float>::infinity();
  pscale[6] = 0;  // valid: the nearest voxel takes it
  const RasterizeResult result = rasterize(set, {0.1, 0});
  EXPECT_EQ(result.skipped, 6u);
  EXPECT_DOUBLE_EQ(result.massParticles, double(mass[6]) + double(mass[7]));
  EXPECT_NEAR(result.massGrid, result.massParticles, 1e-6);
  EXPECT_EQ(statistics(result.density).nans, 0u);
}

TEST(Rasterize, IsTheSameAMillionUnitsAway) {
  // Binary fractions, so that the offset costs no bit of the positions.
  ParticleSet near = randomSet(200, Vec3d(0), 5);
  for (Vec3d& p : near.positions)
    p = glm::round(p * 1024.0) / 1024.0;
  ParticleSet far = near;
  for (Vec3d& p : far.positions)
    p += Vec3d(1 << 20, -(1 << 20), 1 << 19);
  const double voxel = 1.0 / 64;
  const RasterizeResult a = rasterize(near, {voxel, 0}), b = rasterize(far, {voxel, 0});
  ASSERT_EQ(a.density.activeVoxels(), b.density.activeVoxels());
  EXPECT_EQ(statistics(a.density).max, statistics(b.density).max);
  const Vec3d moved = b.density.worldBounds().min - a.density.worldBounds().min;
  EXPECT_EQ(moved, Vec3d(1 << 20, -(1 << 20), 1 << 19));
}

TEST(Rasterize, DefaultsForOneParticleAndNone) {
  ParticleSet set;
  EXPECT_EQ(rasterize(set, {}).density.activeVoxels(), 0u);
  set.positions = {Vec3d(3, 4, 5)};
  const RasterizeResult bare = rasterize(set, {});
  EXPECT_TRUE(bare.radiusFromSpacing);
  EXPECT_EQ(bare.massParticles, 1);
  EXPECT_NEAR(bare.massGrid, 1, 1e-6);
  set.add({"pscale", 1, std::vector<float>{0.5f}});
  const RasterizeResult sized = rasterize(set, {});
  EXPECT_FALSE(sized.radiusFromSpacing);
  EXPECT_EQ(sized.voxelSize, 0.25);
  set.add({"density", 1, std::vector<float>{2}});
  EXPECT_NEAR(rasterize(set, {}).massParticles, 2 * 4.0 / 3 * kPi * 0.125, 1e-12);
}

TEST(Rasterize, DefaultVoxelsDoNotGrowWithEmptySpace) {
  // Two tiny particles a million units apart: half the radius is still few voxels.
  ParticleSet set;
  set.positions = {Vec3d(0), Vec3d(1e6)};
  set.add({"pscale", 1, std::vector<float>{1e-2f, 1e-2f}});
  EXPECT_NEAR(rasterize(set, {}).voxelSize, 5e-3, 1e-8);
}

TEST(Rasterize, RefusesNegativeOptionsAndImpossibleSizes) {
  const ParticleSet set = randomSet(10, Vec3d(0), 6);
  EXPECT_THROW(rasterize(set, {-1, 0}), ConfigError);
  EXPECT_THROW(rasterize(set, {0, std::nan("")}), ConfigError);
  EXPECT_THROW(rasterize(set, {1e-6, 1.0}), MemoryError);
}

TEST(MedianSpacing, OfALatticeIsItsEdge) {
  ParticleSet set;
  for (int i = 0; i < 20 * 20 * 20; ++i)
    set.positions.push_back(0.25 * Vec3d(i % 20, i / 20 % 20, i / 400));
  EXPECT_DOUBLE_EQ(medianSpacing(set), 0.25);
  set.positions.push_back(Vec3d(std::nan("")));
  EXPECT_DOUBLE_EQ(medianSpacing(set), 0.25);
  set.positions = {Vec3d(1), Vec3d(1), Vec3d(1)};
  EXPECT_EQ(medianSpacing(set), 0);
  set.positions = {Vec3d(1)};
  EXPECT_EQ(medianSpacing(set), 0);
}

TEST(MedianSpacing, AgreesWithBruteForce) {
  const ParticleSet set = randomSet(999, Vec3d(0), 7);
  std::vector<double> nearest;
  for (std::size_t i = 0; i < set.size(); ++i) {
    double best = 1e30;
    for (std::size_t j = 0; j < set.size(); ++j)
      if (j != i) best = std::min(best, glm::length(set.positions[i] - set.positions[j]));
    nearest.push_back(best);
  }
  std::sort(nearest.begin(), nearest.end());
  EXPECT_DOUBLE_EQ(medianSpacing(set), nearest[nearest.size() / 2]);
}

double correlation(const openvdb::FloatGrid& source, const openvdb::FloatGrid& other) {
  const auto accessor = other.getConstAccessor();
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  openvdb::CoordBBox box = source.evalActiveVoxelBoundingBox();
  const auto sourceAccessor = source.getConstAccessor();
  for (auto it = box.begin(); it; ++it) {
    const double x = sourceAccessor.getValue(*it);
    const openvdb::Vec3d world = source.indexToWorld(*it);
    const double y = accessor.getValue(other.transform().worldToIndexCellCentered(world));
    n += 1, a += x, b += y, aa += x * x, bb += y * y, ab += x * y;
  }
  return (n * ab - a * b) / std::sqrt((n * aa - a * a) * (n * bb - b * b));
}

TEST(SeedParticles, KeepMassAndFollowTheDensity) {
  const Vec3i dim(32);
  std::vector<float> values;
  for (int i = 0; i < 32 * 32 * 32; ++i) {
    const Vec3d p = Vec3d(i % 32, i / 32 % 32, i / 1024) / 31.0 - 0.5;
    values.push_back(static_cast<float>(std::exp(-20 * glm::dot(p, p))));
  }
  Mat4d matrix(0.1);
  matrix[3] = glm::dvec4(5, 6, 7, 1);
  const Grid source = denseToGrid("density", dim, values, matrix);
  const ParticleSet seeds = seedParticles(source, 20000, 1);
  ASSERT_EQ(seeds.size(), 20000u);
  double sum = 0;
  for (const float v : values)
    sum += v;
  EXPECT_NEAR(seeds.find("mass")->number(0) * 20000 / (sum * 1e-3), 1, 1e-6);
  // The centre of mass is the source's: the middle voxel.
  Vec3d center(0);
  for (const Vec3d& p : seeds.positions)
    center += p / 20000.0;
  EXPECT_LT(glm::length(center - transformPoint(matrix, Vec3d(15.5))), 0.02);
  const RasterizeResult back = rasterize(seeds, {});
  EXPECT_NEAR(back.massGrid / (sum * 1e-3), 1, 1e-5);
  // 20,000 seeds over 32,768 voxels give 0.979; unrelated fields give 0.
  EXPECT_GT(correlation(floats(source), floats(back.density)), 0.97);
  EXPECT_EQ(seedParticles(source, 100, 1).positions, seedParticles(source, 100, 1).positions);
  EXPECT_NE(seedParticles(source, 100, 1).positions, seedParticles(source, 100, 2).positions);
}

TEST(SeedParticles, ASimulatedColumnComesBack) {
  FOREIGN_CACHE(path, "../sims/column_0042.vdb");
  const VdbFile file = readVdb(path);
  const Grid& source = file.find("density");
  const ParticleSet seeds = seedParticles(source, 60000, 1);
  ASSERT_EQ(seeds.size(), 60000u);
  const RasterizeResult back = rasterize(seeds, {});
  const double r = correlation(floats(source), floats(back.density));
  EXPECT_GT(r, 0.94);  // 0.953 measured: 60,000 seeds
}

TEST(SeedParticles, OfNothingAreNone) {
  EXPECT_EQ(seedParticles(denseToGrid("density", Vec3i(1), {0.0f}, Mat4d(1)), 10, 1).size(), 0u);
  EXPECT_THROW(seedParticles(Grid(), 10, 1), InputError);
  EXPECT_THROW(seedParticles(denseVectorToGrid("v", Vec3i(1), {1, 1, 1}, Mat4d(1)), 10, 1),
               InputError);
}

}  // namespace
}  // namespace photosphere::volume
