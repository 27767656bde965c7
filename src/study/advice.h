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

/// Path tracing or light tracing, whichever has an error sooner.
struct PathTime {
  std::string title;   ///< empty where neither was measured
  double seconds = 0;  ///< 0 the same
};
/// Until paths have this relative error, their squared error falling as 1 / time from their last
/// point.
PathTime pathTimeFor(const std::vector<Curve>& curves, double error);

/// How the photosphere fares in one sweep against what is not a photosphere.
struct Verdict {
  double seconds = 0;       ///< at which both are compared
  std::string ours, rival;  ///< titles of the best of each
  double ourError = 0, rivalError = 0;
  PathTime paths;      ///< until paths have our error
  bool known = false;  ///< false where there is nothing to compare
};
/// Compared at the time of the slowest photosphere point of the sweep, over all pixels.
Verdict verdictOf(const SweepResult& sweep, std::size_t layer);

}  // namespace photosphere::study
