#pragma once
// Plots of a study, as SVG for a page.

#include <string>
#include <vector>

#include "curves.h"

namespace photosphere::study {

/// The gnuplot script of relative error over seconds, both logarithmic. Families differ by mark and
/// dash as well as by shade, so that a black and white print reads; points of the Pareto front are
/// ringed. @param height  [pixels], without the key below
std::string errorPlotScript(const std::vector<Curve>& curves, const std::string& title, int width,
                            int height);

/// That plot for a page. @param id  unique in the page: letters alone
std::string errorPlot(const std::vector<Curve>& curves, const std::string& title,
                      const std::string& id, int width, int height);

}  // namespace photosphere::study
