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
  const bool nearEye = estimators::nearEyeBytes(*setup.medium, setup.layout, setup.view) > 0;
  const estimators::LightFieldLayout l =
      nearEye ? estimators::nearLayout(setup.layout) : setup.layout;
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
      "beside it{}; raise estimator.{}{}",
      g, bins ? fmt::format("{} bins", l.bins()) : fmt::format("harmonics of order {}", l.order),
      apart, nearEye ? ", next to the eye" : "", bins ? "rows" : "order",
      nearEye ? ""
              : " (basis = \"view\", without a cache or final_gather, tells all apart but next to "
                "an eye in smoke)"));
}

void noteEyeInSmoke(FrameSetup& setup) {
  if (setup.layout.basis != estimators::Basis::view ||
      !estimators::readsNearEye(*setup.medium, setup.layout, setup.view))
    return;
  setup.notes.push_back(fmt::format(
      "the eye is in smoke that scatters more to one side than to another: {}",
      setup.layout.holdsPower()
          ? "next to it particles keep no directions, and what a lobe sends to the eye is too dim; "
            "estimator.basis = \"histogram\" keeps them"
          : fmt::format("within {:.3g} light voxels of it directions are kept, and looked up "
                        "toward the eye of each ray",
                        setup.layout.nearEye)));
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
