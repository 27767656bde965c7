#pragma once
// How deep a frame's smoke is, for what is chosen by that.

#include <vector>

#include "photosphere/transport/medium.h"

namespace photosphere::scene {

/// Optical depths of rays along the three axes that meet smoke, sorted. @throws InterruptedError
std::vector<double> axisDepths(const transport::Medium& medium);

}  // namespace photosphere::scene
