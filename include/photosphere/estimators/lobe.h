#pragma once
// Phase functions as sums over photons read them.

#include <memory>

#include "photosphere/phase/phase.h"
#include "photosphere/sphere/zonal.h"

namespace photosphere::estimators {

/// A phase function, or its mean over the lobe that smoothing makes of a photon's direction.
/// Immutable; thread-safe.
struct Lobe {
  phase::PhaseFunction phase;
  /// The convolution of phase function and kernel (Min & Ihm 2010, eq. 8 on photons), which
  /// replaces `phase` where there is one.
  std::shared_ptr<const sphere::ZonalTable> smoothed;

  float evaluate(const Vec3f& wi, const Vec3f& wo) const {
    return smoothed ? (*smoothed)(wi, wo) : phase.evaluate(wi, wo);
  }
};

/// The phase function smoothed by a kernel, which need not act: as a table.
Lobe tabulatedLobe(const phase::PhaseFunction& phase, const sphere::SmoothingKernel& kernel);

}  // namespace photosphere::estimators
