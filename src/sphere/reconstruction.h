#pragma once
// Smooth light from a histogram of directions.

#include <vector>

#include "photosphere/sphere/bin_shares.h"

namespace photosphere::sphere {

/// Share of each bin's light that lies in each fine cell, [cell][bin], when the light is the smooth
/// function sum_j c_j b_j that would have been deposited as the histogram. b_j are Gaussians about
/// the bin centres, divided by their sum so that even light stays even; c follows by three steps of
/// Neumann's series, which keeps noise from growing. Every column sums to 1: no energy is gained or
/// lost.
std::vector<double> smoothReconstruction(const BinShares& deposit, const Partition& fine);

/// The same when a bin's light is spread as it was collected: by the deposit's own basis function,
/// scaled to a unit integral (METHOD.md section 5.1).
std::vector<double> depositReconstruction(const BinShares& deposit, const Partition& fine);

}  // namespace photosphere::sphere
