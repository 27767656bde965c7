#pragma once
// Bias and variance from independent seeds.

#include <span>
#include <vector>

#include "photosphere/study/result.h"

namespace photosphere::study {

/// Two-sided 95 % quantile of Student's t. @param degrees  of freedom, at least 1
double studentT95(int degrees);

/// Mean of independent values with its t-interval; a single value has an infinite one.
Estimate meanEstimate(std::span<const double> values);

/// One value per pixel of R, G, B: what the seeds rendered, or the reference or its variance.
using Planes = std::vector<std::span<const float>>;

/// Splits the error of a frame. With e_i = (frame of seed i - reference) / sqrt(ref^2 + (0.1 mean
/// ref)^2) and G_ij = mean e_i e_j, which share no noise but the reference's for i != j:
/// bias^2 = mean over i != j of G_ij - reference noise, variance = mean G_ii - mean G_ij. Both are
/// unbiased for any number of seeds, and may be negative where they are small. Their intervals are
/// jackknife t-intervals over the seeds; noise of the reference beyond its expectation is not in
/// them.
/// @param seeds  at least 2 (at least 3 for finite intervals)
/// @param mask   as in image::MeasureOptions
ErrorFigures errorFigures(const std::vector<Planes>& seeds, const Planes& reference,
                          const Planes& referenceVariance, std::span<const unsigned char> mask);

}  // namespace photosphere::study
