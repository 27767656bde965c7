#pragma once
// The tables of the page.

#include "curves.h"
#include "html.h"
#include "photosphere/study/result.h"

namespace photosphere::study {

Table pointTable(const SweepResult& sweep);
Table errorTable(const SweepResult& sweep, std::size_t layer, std::size_t region);
Table equalTimeTable(const std::vector<Curve>& curves);
Table equalErrorTable(const std::vector<Curve>& curves);
Table crossoverTable(const std::vector<Curve>& curves);
Table hardCaseTable(const StudyResult& result);
/// Error of each basis by its bytes and its seconds, for every g.
Table basisTable(const StudyResult& result);
/// Estimated against measured error of frames that were asked for one, in every scene.
Table estimateTable(const StudyResult& result);
Table flickerTable(const StudyResult& result);
Table leftOutTable(const StudyResult& result);
Table referenceTable(const StudyResult& result);

}  // namespace photosphere::study
