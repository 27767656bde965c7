#pragma once
// Phase functions seen by photons whose directions are smoothed.

#include <functional>
#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/phase/phase.h"

namespace photosphere::estimators {

/// A phase function toward the eye, averaged over the lobe that direction smoothing makes of a
/// photon's direction (Min & Ihm 2010, eq. 8 on photons, their figure 11): the convolution of two
/// functions of the angle alone, which is again one. It integrates to 1 as the phase function does,
/// so smoothing moves light between directions and loses none (the planar normalisation of eq. 8
/// does). Immutable; thread-safe.
class SmoothedPhase {
 public:
  /// @param kernel   of the angle from the photon's direction [radians], any scale: it is
  ///                 normalised over the sphere
  /// @param support  angle beyond which the kernel is zero [radians], clipped to pi
  SmoothedPhase(const phase::HenyeyGreenstein& phase, const std::function<double(double)>& kernel,
                double support);

  /// @param wi, wo  unit propagation directions before and after. @return [1/sr]
  float evaluate(const Vec3f& wi, const Vec3f& wo) const {
    const Vec3f d = wo - wi;
    // |wo - wi| / 2 = sin(theta / 2), in which the lobe's peak is as wide as in the angle.
    const float u = 0.5f * std::sqrt(glm::dot(d, d)) * static_cast<float>(kSteps);
    const int i = static_cast<int>(glm::min(u, static_cast<float>(kSteps - 1)));
    const float f = u - static_cast<float>(i);
    const auto at = static_cast<std::size_t>(i);
    return glm::max(0.0f, m_table[at] + f * (m_table[at + 1] - m_table[at]));
  }

 private:
  static constexpr int kSteps = 2048;
  std::vector<float> m_table;  // over sin(theta / 2) from 0 to 1
};

}  // namespace photosphere::estimators
