// The weight by what an eye sees: its mean over a voxel against many points.
#include "visible_weight.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/media.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

using namespace estimators;

TEST(VisibleWeight, MeanIsThatOfManyPoints) {
  for (const double depth : {1.0, 60.0, 3000.0})
    for (const Vec3f& toEye : {Vec3f(0.2f, 0.1f, 1.0f), Vec3f(-1, 2, 1.5f), Vec3f(1, 0, 0)}) {
      MediumOptions options;
      options.extinction = depth;
      const transport::Medium medium = makeMedium(sampledVolume(
          1.0, 16, options, [](const Vec3d& p) { return glm::length(p) < 0.35 ? 1.0 : 0.0; }));
      const transport::SupportLattice lattice(medium, 2 * medium.voxelEdge(), 1);
      View view;
      view.hasEye = false;
      view.direction = -glm::normalize(toEye);
      const VisibleWeight weight(medium, lattice, view);
      double all = 0, expected = 0, off = 0;
      for (std::size_t v = 0; v < lattice.size(); ++v) {
        Rng rng(RandomKey::fromSeed(4, 0), RandomStream::test, v);
        double sum = 0;
        const int points = kSanitized ? 200 : 2000;
        for (int i = 0; i < points; ++i) {
          const Vec3f u(rng.uniform(), rng.uniform(), rng.uniform());
          sum += static_cast<double>(
              weight.at(v, lattice.center(v) + (u - 0.5f) * static_cast<float>(lattice.edge())));
        }
        const auto mean = static_cast<double>(weight.mean(v));
        all += mean;
        expected += sum / points;
        off += std::abs(mean - sum / points);
      }
      // Voxels of which hardly anything is seen are left out; many points are few in thick smoke.
      EXPECT_NEAR(all / expected, 1.0, depth > 1 ? 0.06 : 0.015) << depth << ' ' << toEye.x;
      if (!kSanitized) {
        EXPECT_LT(off / expected, depth > 1 ? 0.2 : 0.08) << depth << ' ' << toEye.x;
      }
    }
}

}  // namespace
}  // namespace photosphere::test
