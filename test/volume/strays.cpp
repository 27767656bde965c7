// Strays: what lies so far from nearly all of the smoke that no box should be drawn around both.
#include "photosphere/volume/strays.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>

#include "openvdb_instances.h"
#include "photosphere/core/rng.h"
#include "photosphere/volume/rasterize.h"
#include "photosphere/volume/vdb_file.h"
#include "photosphere/volume/velocity.h"
#include "support/support.h"

namespace photosphere::volume {
namespace {

// Particles in a cube of edge 1 with its corner at the origin.
ParticleSet cubeOf(std::size_t count) {
  Rng rng(RandomKey::fromSeed(3, 0), RandomStream::test, 0);
  ParticleSet set;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = rng.uniformDouble(), y = rng.uniformDouble(), z = rng.uniformDouble();
    set.positions.emplace_back(x, y, z);
  }
  set.add({"pscale", 1, std::vector<float>(count, 0.05f)});
  return set;
}

ParticleSet with(ParticleSet set, const Vec3d& stray, int times = 1) {
  for (int i = 0; i < times; ++i)
    set.positions.push_back(stray);
  set.add({"pscale", 1, std::vector<float>(set.size(), 0.05f)});
  return set;
}

std::optional<Strays> strayParticles(const ParticleSet& set) {
  return rasterize(set, {.leaveOutStrays = true}).strays;
}

// Beside two leaves of ones, single voxels of `value`.
Grid gridWith(const std::vector<Vec3i>& strays, float value = 1.0f, double edge = 0.5) {
  auto grid = openvdb::FloatGrid::create();
  grid->denseFill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(15)), 1.0f);
  for (const Vec3i& s : strays)
    grid->tree().setValueOn(openvdb::Coord(s.x, s.y, s.z), value);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(edge));
  grid->setName("density");
  return Grid(grid);
}

TEST(Strays, OneParticleFarAwayIsFoundAtAnyDistance) {
  for (const double d : {100.0, 1e3, 1e6, 1e12, 1e30, 1e100})
    for (const Vec3d& way : {Vec3d(1, 0, 0), Vec3d(0, -1, 0), Vec3d(1, 1, -1)}) {
      const auto strays = strayParticles(with(cubeOf(1000), d * way));
      ASSERT_TRUE(strays) << d;
      EXPECT_EQ(strays->count, 1u);
      EXPECT_EQ(strays->all, 1001u);
      EXPECT_NEAR(strays->share, 1 / 1001.0, 1e-6);
      EXPECT_NEAR(strays->size, 1.1, 0.02);
      EXPECT_NEAR(strays->farthest / (d * glm::length(way)), 1, 0.1);
      EXPECT_FALSE(strays->kept.contains(d * way));
      for (const Vec3d& p : cubeOf(1000).positions)
        ASSERT_TRUE(strays->kept.contains(p));
    }
}

// Whatever else is cut to the box, a velocity say, must reach as far as what stays.
TEST(Strays, WhatStaysIsKeptWithItsRadius) {
  ParticleSet set = with(with(cubeOf(1000), Vec3d(-10, 0, 0)), Vec3d(1e6, 0, 0));
  set.add({"pscale", 1, std::vector<float>(set.size(), 0.5f)});
  const auto strays = strayParticles(set);
  ASSERT_TRUE(strays);
  EXPECT_EQ(strays->count, 1u);
  EXPECT_LE(strays->kept.min.x, -10.5);
}

TEST(Strays, WhatCountsIsNone) {
  EXPECT_FALSE(strayParticles(cubeOf(1000)));
  EXPECT_FALSE(strayParticles(with(cubeOf(1000), Vec3d(60, 0, 0)))) << "too near";
  EXPECT_FALSE(strayParticles(with(cubeOf(1000), Vec3d(1e3, 0, 0), 100))) << "a cloud of its own";
  EXPECT_FALSE(strayParticles(with(cubeOf(3), Vec3d(1e3, 0, 0)))) << "a quarter of all";
  EXPECT_FALSE(strayParticles(cubeOf(1)));
  EXPECT_FALSE(strayParticles(ParticleSet{}));
  ParticleSet heavy = with(cubeOf(1000), Vec3d(1e3, 0, 0));
  std::vector<float> mass(1001, 1.0f);
  mass.back() = 10.0f;
  heavy.add({"mass", 1, mass});
  EXPECT_FALSE(strayParticles(heavy)) << "1 % of the mass";
  ParticleSet nothing = cubeOf(1000);
  nothing.add({"mass", 1, std::vector<float>(1000, 0.0f)});
  EXPECT_FALSE(strayParticles(nothing));
}

TEST(Strays, SeveralRoundAboutAndPositionsThatAreNone) {
  ParticleSet set = cubeOf(2000);
  for (const double d : {100.0, 1e4, 1e9})
    for (const Vec3d& way : {Vec3d(1, 0, 0), Vec3d(0, 0, -1)})
      set.positions.push_back(d * way);
  set.positions.emplace_back(std::numeric_limits<double>::quiet_NaN(), 0, 0);
  set.add({"pscale", 1, std::vector<float>(set.size(), 0.05f)});
  const auto strays = strayParticles(set);
  ASSERT_TRUE(strays);
  EXPECT_EQ(strays->count, 6u);
  EXPECT_NEAR(strays->farthest, 1e9, 10);
  EXPECT_NE(strays->text("particles").find("6 of 2006 particles (0.3 % of the smoke) lie up to"),
            std::string::npos)
      << strays->text("particles");
}

TEST(Strays, VoxelsOfGrids) {
  const std::vector<Vec3i> far{{100000, 0, 0}, {0, -2000000, 5}};
  const Grid grid = gridWith(far);
  const auto strays = findStrays({&grid, 1});
  ASSERT_TRUE(strays);
  EXPECT_EQ(strays->count, 2u);
  EXPECT_EQ(strays->all, 16u * 16u * 16u + 2u);
  const Grid rest = clipped(grid, strays->kept);
  EXPECT_EQ(rest.activeVoxels(), 16u * 16u * 16u);
  EXPECT_EQ(rest.activeBounds().max, Vec3i(15));
  EXPECT_EQ(grid.activeVoxels(), 16u * 16u * 16u + 2u) << "the original is shared";
  const Grid plain = gridWith({}), near = gridWith({{900, 0, 0}}), dense = gridWith(far, 1000.0f);
  EXPECT_FALSE(findStrays({&plain, 1}));
  EXPECT_FALSE(findStrays({&near, 1}));
  EXPECT_FALSE(findStrays({&dense, 1})) << "it holds a third of the smoke";
}

// Of a grid whose voxels are turned, those that are named go, and no other: neither a leaf at the
// edge of what is kept, nor one that a box around it would hold.
TEST(Strays, VoxelsOfATurnedGrid) {
  for (const int at : {3000, 5000, 100000}) {
    const Grid straight = gridWith({{at, 0, 0}, {0, 1000, 0}});
    Mat4d turn(1.0);
    turn[0] = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};
    turn[1] = {-std::sqrt(0.5), std::sqrt(0.5), 0, 0};
    const Grid grid = transformed(straight, turn);
    const auto strays = findStrays({&grid, 1});
    ASSERT_TRUE(strays) << at;
    EXPECT_EQ(strays->count, 1u);
    EXPECT_EQ(clipped(grid, strays->kept).activeVoxels(), grid.activeVoxels() - 1) << at;
  }
}

TEST(Strays, TilesGoAsVoxelsDo) {
  auto tiles = openvdb::FloatGrid::create();
  tiles->fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(127)), 1.0f);
  tiles->fill(openvdb::CoordBBox(openvdb::Coord(1 << 20), openvdb::Coord((1 << 20) + 7)), 1.0f);
  const Grid grid(tiles);
  const auto strays = findStrays({&grid, 1});
  ASSERT_TRUE(strays);
  EXPECT_EQ(strays->count, 512u);
  EXPECT_EQ(clipped(grid, strays->kept).activeVoxels(), 128u * 128u * 128u);
}

// Nothing that was not named is lost.
TEST(Strays, ParticlesAtTheEdgeOfWhatIsKeptStay) {
  for (int i = 0; i < 200; ++i) {
    ParticleSet set = with(cubeOf(1000), Vec3d(1e4, 0, 0));
    set.positions.emplace_back(64 * 1.1 * (0.99 + 1e-4 * i), 0.3, 0.3);
    set.add({"pscale", 1, std::vector<float>(set.size(), 0.05f)});
    const RasterizeResult result = rasterize(set, {.leaveOutStrays = true});
    ASSERT_TRUE(result.strays);
    EXPECT_NEAR(result.massParticles, 1002.0 - static_cast<double>(result.strays->count), 1e-9);
  }
}

TEST(Strays, OfAnotherSizeAndSpeedDoNotMatter) {
  ParticleSet set = with(cubeOf(1000), Vec3d(1e6, 0, 0));
  std::vector<float> radii(1001, 0.05f), v(3003, 1.0f);
  radii.back() = 1e4f;
  v.back() = 1e9f;
  set.add({"pscale", 1, radii});
  set.add({"v", 3, v});
  const RasterizeResult result = rasterize(set, {.leaveOutStrays = true});
  ASSERT_TRUE(result.strays);
  EXPECT_NEAR(result.radiusMax, 0.05, 1e-6);
  const Grid velocity = velocityOfParticles(set, "v", {.within = result.strays->kept}, "test");
  double most = 0;
  const auto& vectors = dynamic_cast<const openvdb::Vec3SGrid&>(*velocity.base());
  for (auto value = vectors.cbeginValueOn(); value; ++value)
    for (int c = 0; c < 3; ++c)
      most = std::max(most, std::abs(static_cast<double>((*value)[c]) - 1));
  EXPECT_LT(most, 1e-3);
}

// Fire that stands apart is none, though the density knows nothing of it.
TEST(Strays, GridsOfOneFileAreSeenTogether) {
  auto fire = openvdb::FloatGrid::create();
  fire->denseFill(openvdb::CoordBBox(openvdb::Coord(200, 0, 0), openvdb::Coord(215, 15, 15)), 3.0f);
  fire->setTransform(openvdb::math::Transform::createLinearTransform(0.5));
  const Grid apart[] = {gridWith({}), Grid(fire)};
  EXPECT_FALSE(findStrays(apart));
  fire->tree().setValueOn(openvdb::Coord(0, 0, 40000000), 1e-3f);
  const Grid stray[] = {gridWith({}), Grid(fire), Grid()};
  const auto strays = findStrays(stray);
  ASSERT_TRUE(strays);
  EXPECT_EQ(strays->count, 1u);
  EXPECT_EQ(clipped(stray[1], strays->kept).activeVoxels(), 16u * 16u * 16u);
  EXPECT_EQ(clipped(stray[0], strays->kept).activeVoxels(), 16u * 16u * 16u);
}

TEST(Strays, RasterizingWithoutThemIsRasterizingTheRest) {
  const ParticleSet rest = cubeOf(1000);
  const RasterizeResult wanted = rasterize(rest, {});
  const RasterizeResult result = rasterize(with(rest, Vec3d(1e9, 0, 0)), {.leaveOutStrays = true});
  ASSERT_TRUE(result.strays);
  EXPECT_EQ(result.voxelSize, wanted.voxelSize);
  EXPECT_NEAR(result.massParticles, wanted.massParticles, 1e-9);
  EXPECT_EQ(result.density.activeVoxels(), wanted.density.activeVoxels());
  const auto& a = dynamic_cast<const openvdb::FloatGrid&>(*wanted.density.base());
  const auto& b = dynamic_cast<const openvdb::FloatGrid&>(*result.density.base());
  for (auto value = a.cbeginValueOn(); value; ++value)
    ASSERT_EQ(b.tree().getValue(value.getCoord()), *value);
  // By themselves the voxels would have to hold both.
  EXPECT_GT(rasterize(with(rest, Vec3d(1e9, 0, 0)), {}).voxelSize, 10 * wanted.voxelSize);
}

}  // namespace
}  // namespace photosphere::volume
