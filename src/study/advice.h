#pragma once
// When to use which, in sentences written from the figures.

#include <string>
#include <vector>

#include "photosphere/study/result.h"

namespace photosphere::study {

/// Sentences for people, each true of the figures at hand. Plain text: escape it for a page.
std::vector<std::string> advice(const StudyResult& result);

/// How the photosphere fares in one sweep against what is not a photosphere.
struct Verdict {
  double seconds = 0;       ///< at which both are compared
  std::string ours, rival;  ///< titles of the best of each
  double ourError = 0, rivalError = 0;
  bool known = false;  ///< false where there is nothing to compare
};
/// Compared at the time of the slowest photosphere point of the sweep, in layer `multiple`, over
/// all pixels: what light carriers are for.
Verdict verdictOf(const SweepResult& sweep);

}  // namespace photosphere::study
