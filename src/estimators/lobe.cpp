#include "photosphere/estimators/lobe.h"

namespace photosphere::estimators {

Lobe tabulatedLobe(const phase::PhaseFunction& phase, const sphere::SmoothingKernel& kernel) {
  const sphere::LegendreMoments moments = phase::legendreMoments(phase);
  return {phase, std::make_shared<sphere::ZonalTable>(
                     sphere::convolved(moments, sphere::kernelMoments(kernel, moments.size())))};
}

}  // namespace photosphere::estimators
