#pragma once
// The figures of a study as CSV and JSON.

#include <string>
#include <vector>

#include "photosphere/study/result.h"

namespace photosphere::study {

/// A field of RFC 4180: quoted where it holds a comma, a quote or a line break. One that a
/// spreadsheet would take for a formula begins with an apostrophe.
std::string csvField(const std::string& text);

/// Of the scene, the hard cases and the bases.
std::vector<const SweepResult*> allSweeps(const StudyResult& result);

/// One row for every point, layer and region; the header row names the units. Lines end in CR LF.
std::string csvText(const StudyResult& result);
/// Always valid JSON: what is not finite is null, what is not UTF-8 is replaced.
std::string jsonText(const StudyResult& result);

}  // namespace photosphere::study
