// The weight by what an eye sees: its mean over a voxel against many points.
#include "visible_weight.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/media.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

using namespace estimators;

// Mean over the lattice of voxels' means over many points' ones, and the sum of the differences
// over that of the points'.
struct Agreement {
  double ratio = 0, off = 0;
};

constexpr int kManyPoints = 2000, kPoints = kSanitized ? 200 : kManyPoints;  // in a voxel

Agreement agreement(double depth, const View& view, Basis basis = Basis::view,
                    int points = kPoints) {
  MediumOptions options;
  options.extinction = depth;
  const transport::Medium medium = makeMedium(sampledVolume(
      1.0, 16, options, [](const Vec3d& p) { return glm::length(p) < 0.35 ? 1.0 : 0.0; }));
  const transport::SupportLattice lattice(medium, 2 * medium.voxelEdge(), 1);
  LightFieldLayout layout;
  layout.basis = basis;
  const VisibleWeight weight(medium, lattice, layout, view);
  double all = 0, expected = 0, off = 0;
  for (std::size_t v = 0; v < lattice.size(); ++v) {
    Rng rng(RandomKey::fromSeed(4, 0), RandomStream::test, v);
    double sum = 0;
    for (int i = 0; i < points; ++i) {
      const Vec3f u(rng.uniform(), rng.uniform(), rng.uniform());
      sum += static_cast<double>(weight.at(
          v, lattice.center(v) + (u - 0.5f) * static_cast<float>(lattice.edge()), rng.uniform2()));
    }
    const auto mean = static_cast<double>(weight.mean(v));
    all += mean;
    expected += sum / points;
    off += std::abs(mean - sum / points);
  }
  return {all / expected, off / expected};
}

TEST(VisibleWeight, MeanIsThatOfManyPoints) {
  for (const double depth : {1.0, 60.0, 3000.0})
    for (const Vec3f& toEye : {Vec3f(0.2f, 0.1f, 1.0f), Vec3f(-1, 2, 1.5f), Vec3f(1, 0, 0)}) {
      View view;
      view.hasEye = false;
      view.direction = -glm::normalize(toEye);
      const Agreement found = agreement(depth, view);
      // Voxels of which hardly anything is seen are left out; many points are few in thick smoke.
      EXPECT_NEAR(found.ratio, 1.0, depth > 1 ? 0.06 : 0.015) << depth << ' ' << toEye.x;
      if (!kSanitized) {
        EXPECT_LT(found.off, depth > 1 ? 0.2 : 0.08) << depth << ' ' << toEye.x;
      }
    }
}

TEST(VisibleWeight, MeanIsThatOfManyPointsAllRound) {
  for (const double depth : {1.0, 60.0, 3000.0}) {
    const Agreement found = agreement(depth, View(), Basis::histogram);
    EXPECT_NEAR(found.ratio, 1.0, depth > 1 ? 0.06 : 0.015) << depth;
    if (!kSanitized) {
      EXPECT_LT(found.off, depth > 1 ? 0.25 : 0.08) << depth;
    }
  }
}

// From beside the smoke into it. In the thickest smoke points that an eye inside it sees are so few
// that they tell nothing.
TEST(VisibleWeight, MeanIsThatOfManyPointsWhereverTheEyeIs) {
  for (const double depth : {1.0, 30.0})
    for (const Vec3d& eye : {Vec3d(0, 0, 2), Vec3d(0.1, 0.05, 0.45), Vec3d(0.1, 0.05, 0.36),
                             Vec3d(0.1, 0.05, 0.2), Vec3d(0.0), Vec3d(0.125, 0.02, 0.03)}) {
      View view;
      view.eye = eye;
      // In thick smoke few points say little of what is around an eye.
      const int points = depth > 1 ? kManyPoints : kPoints;
      const Agreement found = agreement(depth, view, Basis::view, points);
      // Voxels behind the nearest are left out.
      EXPECT_NEAR(found.ratio, 1.0, depth > 1 ? 0.17 : 0.015) << depth << ' ' << eye.z;
      if (!kSanitized) {
        EXPECT_LT(found.off, depth > 1 ? 0.25 : 0.08) << depth << ' ' << eye.z;
      }
    }
}

// All that an eye in thick smoke sees is near it: 8 pi / sigma^2 of solid angle times length.
TEST(VisibleWeight, AnEyeInOpaqueSmokeSeesWhatIsAroundIt) {
  constexpr double kDepth = 3000;
  MediumOptions options;
  options.extinction = kDepth;
  const transport::Medium medium =
      makeMedium(sampledVolume(1.0, 16, options, [](const Vec3d&) { return 1.0; }));
  const transport::SupportLattice lattice(medium, 2 * medium.voxelEdge(), 1);
  View view;
  view.eye = Vec3d(0.07, 0.05, 0.06);  // the middle of a voxel, all but that
  LightFieldLayout layout;
  layout.basis = Basis::view;
  const VisibleWeight weight(medium, lattice, layout, view);
  double sum = 0;
  for (std::size_t v = 0; v < lattice.size(); ++v)
    sum += static_cast<double>(weight.mean(v));
  // Of sigma exp(-sigma r) over space, in units of a voxel.
  const double edge = lattice.edge();
  EXPECT_NEAR(sum * edge * edge / (8 * kPi / (kDepth * kDepth)), 1.0, 0.1);
}

}  // namespace
}  // namespace photosphere::test
