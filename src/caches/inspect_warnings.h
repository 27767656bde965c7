#pragma once
// What the numbers of a report mean to someone who wants to render it.

#include "photosphere/caches/inspect.h"

namespace photosphere::caches {

/// Fills `unitsGuess` and `warnings` from the measured parts of a report.
void judge(InspectReport& report, const CacheContent& content);

/// True for the names that smoke density goes by.
bool isDensityName(std::string_view name);

}  // namespace photosphere::caches
