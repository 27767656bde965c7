#include "light_notes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace photosphere::scene {

namespace {

// Directions that stored light tells apart lie so many widths of a lobe apart before it is said. By
// then 32 bins show a fifth less light than there is, or a lobe's light beside it (README.md,
// bases of directions). Light that goes back where it came from comes back once more: of lobes of
// -0.9, 3 widths apart, 128 bins show a quarter more light than there is, of -0.8 a twentieth.
constexpr double kWidths = 6, kWidthsBackward = 2;

// A ball of three spacings, the automatic radius, holds about as many particles.
constexpr std::size_t kFewCarriers = 20;

// |g| from where on what an eye in smoke sees next to it is too dim toward a light: a frame by 0.07
// at 0.5, 0.12 at 0.8, 0.2 at 0.9 (0.03 at 0.3), what in it was scattered more than once by 0.2 and
// 0.25 at the last two, next to a lamp by a third at 0.85, and what its surface sends by a quarter.
// In 128 bins read per step light scattered more than once is within 0.04.
constexpr double kForwardLobe = 0.5;
constexpr double kSeenDepth = 0.01;  // of a light voxel that has a part in the picture

}  // namespace

double sharpestLobe(const transport::Medium& medium) {
  double sharpest = 0;
  for (const phase::PhaseFunction& phase : medium.phases())
    for (int i = 0; i < phase.lobes(); ++i)
      sharpest = std::max(sharpest, std::abs(phase.lobe(i).g()));
  return sharpest;
}

void noteCoarseDirections(FrameSetup& setup) {
  using estimators::Basis;
  const estimators::LightFieldLayout& l = setup.layout;
  if (l.basis == Basis::view) return;
  const bool bins = l.basis == Basis::histogram;
  const double apart = bins ? std::sqrt(4 * kPi / l.bins()) : kPi / std::max(1, l.order);  // [rad]
  double g = 0, worst = 1;
  for (const phase::PhaseFunction& phase : setup.medium->phases())
    for (int i = 0; i < phase.lobes(); ++i) {
      const double own = phase.lobe(i).g(), size = std::abs(own);
      // Henyey and Greenstein's lobe has fallen to a third or so of its peak there.
      const double width = (1 - size) / std::sqrt(size);
      const double coarse = apart / ((own < 0 ? kWidthsBackward : kWidths) * width);
      if (size > 0 && coarse > worst) {
        g = own;
        worst = coarse;
      }
    }
  if (g == 0) return;
  setup.notes.push_back(fmt::format(
      "a phase function has a lobe of g = {:.6g}, narrower than the directions that stored light "
      "tells apart ({}, {:.2g} rad): light scattered more than once is too dim in it or too bright "
      "beside it; raise estimator.{} (basis = \"view\", without a cache or final_gather, tells all "
      "apart)",
      g, bins ? fmt::format("{} bins", l.bins()) : fmt::format("harmonics of order {}", l.order),
      apart, bins ? "rows" : "order"));
}

void noteEyeInSmoke(FrameSetup& setup) {
  const double lobe = sharpestLobe(*setup.medium);
  if (!setup.view.hasEye || setup.layout.evaluate != estimators::Evaluate::perView ||
      lobe < kForwardLobe)
    return;
  const double edge = setup.layout.lightVoxel * setup.medium->voxelEdge();
  double depth = 0;  // of the way through a light voxel, in the mean of the 27 around the eye
  for (int i = 0; i < 27; ++i)
    depth += edge / 27 *
             static_cast<double>(setup.medium->extinction(
                 Vec3f(setup.view.eye + edge * Vec3d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1))));
  if (!(depth > kSeenDepth)) return;
  setup.notes.push_back(fmt::format(
      "the eye is in smoke that scatters into a lobe of |g| = {:.3g}: along it, stored light (of "
      "lamps with a surface, and scattered more than once) is up to a third too dim next to the "
      "eye; estimator.basis = \"histogram\" with evaluate = \"per_step\" and rows = 4 keeps its "
      "directions apart, in ten times the time or more",
      lobe));
}

void noteFewCarriers(FrameSetup& setup) {
  if (setup.layout.carrier != estimators::Carrier::particles ||
      setup.particles.size() >= kFewCarriers)
    return;
  setup.notes.push_back(fmt::format(
      "{} particle{} all the light that is scattered more than once, which is one value around "
      "each; estimator.carrier = \"voxels\" stores it as fine as the smoke",
      setup.particles.size(), setup.particles.size() == 1 ? " carries" : "s carry"));
}

}  // namespace photosphere::scene
