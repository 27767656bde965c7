#pragma once
// Evaluation at every march step, as in the paper (section 4.2.3, eq. 9).

#include <memory>

#include "photosphere/estimators/light_field.h"

namespace photosphere::estimators {

/// Directions and phase fold at each step, toward the very ray. Fluence is smoothed and sharpened
/// bin by bin beforehand, as per view is done colour by colour; power is gathered as it is.
/// @param key  of the bins that Merge::sampled draws: a function of it, place and particle
std::unique_ptr<InscatterSource> evaluatePerStep(const transport::Medium& medium, LightField field,
                                                 RandomKey key);

}  // namespace photosphere::estimators
