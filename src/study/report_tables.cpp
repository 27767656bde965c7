#include "report_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "advice.h"
#include "photosphere/core/resources.h"
#include "tables.h"

namespace photosphere::study {

namespace {

std::string seconds(double value) {
  return fmt::format("{:.3g}", value);
}

std::string spread(const Spread& s) {
  return fmt::format("{:.3g} ({:.3g} to {:.3g})", s.median, s.min, s.max);
}

std::string mebibytes(double bytes) {
  return fmt::format("{:.1f}", bytes / 1048576);
}

std::string interval(const Estimate& e) {
  if (!std::isfinite(e.low) || !std::isfinite(e.high)) return fmt::format("{:.3g}", e.value);
  return fmt::format("{:.3g} ({:.3g} to {:.3g})", e.value, e.low, e.high);
}

std::string optionalNumber(const std::optional<double>& value) {
  return value ? fmt::format("{:.3g}", *value) : std::string("\u2013");
}

}  // namespace

Table pointTable(const SweepResult& sweep) {
  Table table;
  table.caption = fmt::format(
      "Seconds of each stage (medians), CPU seconds (median and range) and peak memory of a "
      "process "
      "of its own, {} x {} pixels; one that does nothing has {:.1f} MiB",
      sweep.width, sweep.height, static_cast<double>(sweep.startMemoryBytes) / 1048576);
  table.rows.push_back({"contender", "read [s]", "rasterize [s]", "trace [s]", "resolve [s]",
                        "march [s]", "total [s]", "CPU [s]", "peak memory [MiB]", "photons stored",
                        "seeds"});
  for (const PointResult& p : sweep.points)
    table.rows.push_back({p.label, seconds(p.seconds.read.median),
                          seconds(p.seconds.rasterize.median), seconds(p.seconds.trace.median),
                          seconds(p.seconds.resolve.median), seconds(p.seconds.march.median),
                          spread(p.seconds.total), spread(p.cpuSeconds),
                          mebibytes(p.peakMemoryBytes.median), std::to_string(p.photonsStored),
                          std::to_string(p.seeds)});
  return table;
}

Table errorTable(const SweepResult& sweep, std::size_t layer, std::size_t region) {
  Table table;
  table.caption = fmt::format("Layer {}, {}: value (95 % interval)", kLayers[layer],
                              region == kAllPixels ? "all pixels" : "smoke only");
  table.rows.push_back(
      {"contender", "relative error", "relMSE", "bias\u00b2", "variance", "mean over reference's"});
  for (const PointResult& p : sweep.points) {
    const ErrorFigures& f = p.errors[layer][region];
    table.rows.push_back({p.label, fmt::format("{:.3g}", relativeError(f)), interval(f.relMse),
                          interval(f.biasSquared), interval(f.variance), interval(f.meanRatio)});
  }
  return table;
}

Table equalTimeTable(const std::vector<Curve>& curves) {
  Table table;
  table.caption =
      "Equal time: relative error after so many seconds a frame, interpolated between "
      "the points measured; the best of each column is marked *";
  const std::vector<double> times = roundTimes(curves);
  std::vector<std::string> head{"contender"};
  for (const double t : times)
    head.push_back(fmt::format("{:g} s", t));
  table.rows.push_back(head);
  for (const Curve& curve : curves) {
    std::vector<std::string> row{curve.title};
    for (const double t : times) {
      const auto own = errorAt(curve, t);
      const bool best = own && std::all_of(curves.begin(), curves.end(), [&](const Curve& other) {
                          const auto rival = errorAt(other, t);
                          return !rival || *own <= *rival;
                        });
      row.push_back(optionalNumber(own) + (best ? " *" : ""));
    }
    table.rows.push_back(row);
  }
  return table;
}

Table equalErrorTable(const std::vector<Curve>& curves) {
  Table table;
  table.caption =
      "Equal error: seconds a frame until the relative error is so small; the fastest "
      "of each column is marked *, a dash was not reached";
  const std::vector<double> errors = roundErrors(curves);
  std::vector<std::string> head{"contender"};
  for (const double e : errors)
    head.push_back(fmt::format("{:g}", e));
  table.rows.push_back(head);
  for (const Curve& curve : curves) {
    std::vector<std::string> row{curve.title};
    for (const double e : errors) {
      const auto own = secondsFor(curve, e);
      const bool best = own && std::all_of(curves.begin(), curves.end(), [&](const Curve& other) {
                          const auto rival = secondsFor(other, e);
                          return !rival || *own <= *rival;
                        });
      row.push_back(optionalNumber(own) + (best ? " *" : ""));
    }
    table.rows.push_back(row);
  }
  return table;
}

Table crossoverTable(const std::vector<Curve>& curves) {
  Table table;
  table.caption = "Crossovers: who is better before and after, where the interpolated curves meet";
  table.firstNumber = 2;
  table.rows.push_back({"better before", "better after", "time [s]", "relative error"});
  for (const Crossover& c : crossovers(curves))
    table.rows.push_back(
        {c.before, c.after, fmt::format("{:.3g}", c.seconds), fmt::format("{:.3g}", c.error)});
  if (table.rows.size() == 1) table.rows.push_back({"none in the times measured", "", "", ""});
  return table;
}

Table hardCaseTable(const StudyResult& result) {
  Table table;
  table.caption =
      "Best photosphere against best other, all pixels, at the time of the slowest photosphere "
      "point; last, when path tracing or light tracing, whichever is sooner, would have the "
      "photosphere's error, its squared error falling as 1 over time";
  table.firstNumber = 4;
  table.rows.push_back({"case", "layer", "photosphere", "other", "time [s]", "photosphere's error",
                        "other's error", "other's over photosphere's", "paths equal at [s]"});
  for (const SweepResult& sweep : result.sweeps)
    for (const std::size_t layer : {kTotal, kMultiple}) {
      const Verdict v = verdictOf(sweep, layer);
      if (!v.known) continue;
      table.rows.push_back({sweep.name, kLayers[layer], v.ours, v.rival,
                            fmt::format("{:.3g}", v.seconds), fmt::format("{:.3g}", v.ourError),
                            fmt::format("{:.3g}", v.rivalError),
                            fmt::format("{:.3g}", v.rivalError / v.ourError),
                            fmt::format("{:.3g}", v.paths.seconds)});
    }
  return table;
}

Table basisTable(const StudyResult& result) {
  Table table;
  table.caption =
      "Bases of directions, layer multiple, all pixels. The last two columns are squared error "
      "times cost, so less is better; the best of those that a light cache can hold (all but view) "
      "is "
      "marked *";
  table.firstNumber = 2;
  table.rows.push_back({"scene", "basis", "stored light [MiB]", "CPU [s]", "relative error",
                        "bias\u00b2", "mean over reference's", "relMSE x CPU s", "relMSE x MiB"});
  for (const SweepResult& sweep : result.bases) {
    const auto cost = [](const PointResult& p, bool bytes) {
      const double mebibytes = static_cast<double>(p.lightMemoryBytes) / 1048576;
      return std::max(0.0, p.errors[kMultiple][kAllPixels].relMse.value) *
             (bytes ? mebibytes : p.cpuSeconds.median);
    };
    const auto marked = [&](const PointResult& p, bool bytes) {
      const bool best =
          isCacheable(p) &&
          std::all_of(sweep.points.begin(), sweep.points.end(), [&](const PointResult& other) {
            return !isCacheable(other) || cost(p, bytes) <= cost(other, bytes);
          });
      return fmt::format("{:.3g}{}", cost(p, bytes), best ? " *" : "");
    };
    for (const PointResult& p : sweep.points) {
      const ErrorFigures& f = p.errors[kMultiple][kAllPixels];
      const bool light = p.lightMemoryBytes > 0;
      table.rows.push_back(
          {sweep.name, p.label,
           light ? mebibytes(static_cast<double>(p.lightMemoryBytes)) : std::string("\u2013"),
           seconds(p.cpuSeconds.median), fmt::format("{:.3g}", relativeError(f)),
           fmt::format("{:.3g}", f.biasSquared.value), fmt::format("{:.3f}", f.meanRatio.value),
           marked(p, false), light ? marked(p, true) : std::string("\u2013")});
    }
  }
  return table;
}

Table estimateTable(const StudyResult& result) {
  Table table;
  table.caption =
      "Relative error of layer total over all pixels, as frames that were asked for one estimate "
      "it of themselves (median and range over the seeds) and as the reference tells it";
  table.firstNumber = 1;
  table.rows.push_back({"scene", "asked for", "estimated", "measured", "estimated over measured",
                        "time [s]", "paths alone [s]"});
  for (const SweepResult& sweep : result.sweeps) {
    const std::vector<Curve> curves = curvesOf(sweep, kTotal, kAllPixels);
    for (const PointResult& p : sweep.points) {
      if (!(p.estimatedError.median > 0)) continue;
      const double measured = relativeError(p.errors[kTotal][kAllPixels]);
      table.rows.push_back(
          {sweep.name, fmt::format("{:.3g}", 1.0 / static_cast<double>(p.work)),
           spread(p.estimatedError), fmt::format("{:.3g}", measured),
           measured > 0 ? fmt::format("{:.3g}", p.estimatedError.median / measured) : "\u2013",
           seconds(p.seconds.total.median), seconds(pathTimeFor(curves, measured).seconds)});
    }
  }
  return table;
}

Table flickerTable(const StudyResult& result) {
  Table table;
  table.caption =
      "Frame-to-frame error, layer total, all pixels: root of the relMSE of the change "
      "of the error from frame to frame";
  table.firstNumber = 3;
  table.rows.push_back({"sequence", "contender", "seed_per_frame", "pairs of frames",
                        "relative error", "relMSE (95 % interval)"});
  for (const FlickerRow& row : result.flicker)
    table.rows.push_back(
        {row.sequence, row.label, row.seedPerFrame ? "true" : "false", std::to_string(row.pairs),
         fmt::format("{:.3g}", std::sqrt(std::max(0.0, row.relMse.value))), interval(row.relMse)});
  return table;
}

Table leftOutTable(const StudyResult& result) {
  Table table;
  table.firstNumber = 9;
  table.rows.push_back({"sweep", "left out", "why"});
  for (const SweepResult* sweep : allSweeps(result))
    for (const LeftOut& item : sweep->leftOut)
      table.rows.push_back({sweep->name, item.name, item.why});
  for (const LeftOut& item : result.leftOut)
    table.rows.push_back({"", item.name, item.why});
  return table;
}

Table referenceTable(const StudyResult& result) {
  Table table;
  table.caption = "References: their noise as relMSE over all pixels (it is subtracted)";
  table.rows.push_back({"sweep", "paths from", "paths a pixel", "of them found", "seconds spent",
                        "noise, total", "noise, multiple", "by contenders' spread",
                        "a tenth of the best or less", "key"});
  for (const SweepResult* sweep : allSweeps(result)) {
    const ReferenceNote& r = sweep->reference;
    table.rows.push_back({sweep->name, r.method == "light_traced" ? "the lamps" : "the eye",
                          std::to_string(r.samples), std::to_string(r.samplesBefore),
                          fmt::format("{:.1f}", r.seconds), fmt::format("{:.2g}", r.noise[kTotal]),
                          fmt::format("{:.2g}", r.noise[kMultiple]),
                          fmt::format("{:.2g}", r.pathNoise[kMultiple]),
                          !r.quiet    ? "no"
                          : r.settled ? "yes"
                                      : "yes, unsettled",
                          r.key});
  }
  return table;
}

}  // namespace photosphere::study
