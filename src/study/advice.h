#pragma once
// When to use which, in sentences written from the figures.

#include <string>
#include <vector>

#include "curves.h"
#include "photosphere/study/result.h"

namespace photosphere::study {

/// Sentences for people, each true of the figures at hand. Plain text: escape it for a page.
std::vector<std::string> advice(const StudyResult& result);

/// Whether a light cache can hold what the contender stores.
bool isCacheable(const PointResult& point);

/// How the photosphere fares in one sweep against what is not a photosphere.
struct Verdict {
  double seconds = 0;       ///< at which both are compared
  std::string ours, rival;  ///< titles of the best of each
  double ourError = 0, rivalError = 0;
  double pathSeconds = 0;  ///< until path tracing has our error; pathSecondsFor
  bool known = false;      ///< false where there is nothing to compare
};
/// Compared at the time of the slowest photosphere point of the sweep, over all pixels.
Verdict verdictOf(const SweepResult& sweep, std::size_t layer);

/// Until path tracing has this relative error [s], its squared error falling as 1 / time from its
/// last point; 0 where it was not measured.
double pathSecondsFor(const std::vector<Curve>& curves, double error);

}  // namespace photosphere::study
