#include "plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "gnuplot.h"
#include "html.h"

namespace photosphere::study {

namespace {

struct Look {
  const char* color;
  int mark, dash;
};
// Dark to middle shades that keep apart in grey; marks and dashes tell them apart without colour.
constexpr std::array<Look, 15> kLooks{{{"#000000", 7, 1},
                                       {"#0050a0", 5, 2},
                                       {"#a03000", 9, 3},
                                       {"#007050", 11, 4},
                                       {"#703090", 13, 5},
                                       {"#806000", 4, 2},
                                       {"#404040", 8, 3},
                                       {"#b00050", 10, 4},
                                       {"#3060c0", 12, 5},
                                       {"#606060", 2, 1},
                                       {"#205020", 1, 2},
                                       {"#905040", 3, 3},
                                       {"#000000", 6, 4},
                                       {"#0050a0", 14, 5},
                                       {"#a03000", 15, 1}}};

// Height of a row of the key [pixels].
constexpr int kKeyRow = 18;

std::string dataBlock(std::size_t index, const Curve& curve) {
  std::string text = fmt::format("$curve{} << EOD\n", index);
  // Joined in the order of their work: times have noise.
  std::vector<CurvePoint> points = curve.points;
  std::stable_sort(points.begin(), points.end(),
                   [](const CurvePoint& a, const CurvePoint& b) { return a.work < b.work; });
  for (const CurvePoint& p : points)
    text += fmt::format("{:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g}\n", p.seconds, p.secondsMin,
                        p.secondsMax, p.error, p.low, p.high);
  return text + "EOD\n";
}

// Room above and below the points; an interval that reaches toward 0 is cut off there.
std::string errorRange(const std::vector<Curve>& curves) {
  double low = 1e300, high = 0;
  for (const Curve& curve : curves)
    for (const CurvePoint& p : curve.points) {
      low = std::min(low, p.error);
      high = std::max(high, std::min(p.high, 3 * p.error));
    }
  return fmt::format("set yrange [{:.9g}:{:.9g}]\n", low / 2, high * 1.3);
}

// Labels at 1, 2 and 5 of each decade: a narrow range would else show one of them or none.
std::string labels(const char* axis) {
  std::string text = fmt::format("set {}tics (", axis);
  for (int decade = -7; decade <= 6; ++decade)
    for (const int digit : {1, 2, 5})
      text += fmt::format("{}'{:g}' {}e{}", decade == -7 && digit == 1 ? "" : ", ",
                          digit * std::pow(10.0, decade), digit, decade);
  return text + ")\n";
}

std::string frontBlock(const std::vector<Curve>& curves) {
  std::vector<std::pair<double, double>> front;
  for (const Curve& curve : curves)
    for (const CurvePoint& p : curve.points)
      if (p.onFront) front.emplace_back(p.seconds, p.error);
  std::sort(front.begin(), front.end());
  std::string text = "$front << EOD\n";
  for (const auto& [seconds, error] : front)
    text += fmt::format("{:.9g} {:.9g}\n", seconds, error);
  return text + "EOD\n";
}

}  // namespace

std::string errorPlotScript(const std::vector<Curve>& curves, const std::string& title, int width,
                            int height) {
  std::string text = frontBlock(curves);
  for (std::size_t i = 0; i < curves.size(); ++i)
    text += dataBlock(i, curves[i]);
  text += fmt::format(
      "set terminal svg noenhanced size {},{} font 'sans-serif,14' dashlength 1.5 linewidth 1.2\n"
      "set title '{}' noenhanced\nset logscale xy\nset format '%g'\n"
      "set xlabel 'time of a frame [s], median and range of the seeds'\n"
      "set ylabel 'relative error, root of relMSE [1], 95 % interval'\n"
      "set grid xtics ytics lc '#d8d8d8' lw 0.5\n"
      "set key below maxcols 1 Left reverse noenhanced\nset border lw 1\nset offsets graph 0.05, "
      "graph 0.05, 0, 0\n",
      width, height + kKeyRow * static_cast<int>(curves.size() + 1), gnuplotText(title));
  text += errorRange(curves) + labels("x") + labels("y");
  text += "plot $front using 1:2 with lines lc '#b0b0b0' lw 5 title 'Pareto front (ringed)', \\\n";
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const Look& look = kLooks[i % kLooks.size()];
    text += fmt::format(
        "  $curve{0} using 1:4:2:3:5:6 with xyerrorbars lc '{1}' lw 0.8 pt 0 notitle, \\\n"
        "  $curve{0} using 1:4 with linespoints lc '{1}' lw 1.6 dt {2} pt {3} ps 0.9 title '{4}', "
        "\\\n",
        i, look.color, look.dash, look.mark, gnuplotText(curves[i].title));
  }
  return text + "  $front using 1:2 with points lc black lw 1.6 pt 6 ps 2.0 notitle\n";
}

std::string errorPlot(const std::vector<Curve>& curves, const std::string& title,
                      const std::string& id, int width, int height) {
  if (curves.empty()) return {};
  return inlineSvg(runGnuplot(errorPlotScript(curves, title, width, height)), id,
                   title +
                       ": relative error over seconds for each family of contenders, the "
                       "numbers are in the tables and in study.csv");
}

}  // namespace photosphere::study
