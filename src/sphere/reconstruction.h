#pragma once
// Smooth light from a histogram of directions.

#include <vector>

#include "photosphere/sphere/partition.h"

namespace photosphere::sphere {

/// Share of each bin's light that lies in each fine cell, [cell][bin], when the light is the smooth
/// function sum_j c_j b_j whose bin means are the histogram's. b_j are Gaussians about the bin
/// centres, divided by their sum so that even light stays even; c follows from the means by three
/// steps of Neumann's series, which keeps noise from growing. Every column sums to 1: no energy is
/// gained or lost.
std::vector<double> smoothReconstruction(const Partition& bins, const Partition& fine);

}  // namespace photosphere::sphere
