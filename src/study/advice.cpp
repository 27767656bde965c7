#include "advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "contenders.h"
#include "curves.h"
#include "photosphere/core/resources.h"

namespace photosphere::study {

namespace {

bool isPaths(const std::string& family) {
  return family == "path_traced" || family == "light_traced";
}

bool isPhotosphere(const std::string& family) {
  return !isPaths(family) && family != "single" && family.rfind("photon_map", 0) != 0;
}

struct Best {
  const Curve* curve = nullptr;
  double error = 0;
};

template <class Accept>
Best bestAt(const std::vector<Curve>& curves, double seconds, const Accept& accept) {
  Best best;
  for (const Curve& curve : curves) {
    const auto error = errorAt(curve, seconds);
    if (!error || !accept(curve) || (best.curve && *error >= best.error)) continue;
    best = {&curve, *error};
  }
  return best;
}

std::string percent(double error) {
  return 100 * error < 10 ? fmt::format("{:.2g} %", 100 * error)
                          : fmt::format("{:.0f} %", 100 * error);
}

std::string time(double seconds) {
  return fmt::format("{:.2g} s", seconds);
}

const PointResult* pointNamed(const SweepResult& sweep, const std::string& label) {
  for (const PointResult& p : sweep.points)
    if (p.label == label) return &p;
  return nullptr;
}

// Who is best when, from one round time to the next.
void addBestByTime(const std::vector<Curve>& curves, std::vector<std::string>& out) {
  std::string last, parts;
  for (const double seconds : roundTimes(curves)) {
    const Best best = bestAt(curves, seconds, [](const Curve&) { return true; });
    if (!best.curve || best.curve->title == last) continue;
    parts += fmt::format("{}from {} on {} (relative error {} there)", parts.empty() ? "" : ", ",
                         time(seconds), best.curve->title, percent(best.error));
    last = best.curve->title;
  }
  if (!parts.empty())
    out.push_back(
        "Light scattered more than once has the least error at equal time with: " + parts + ".");
}

void addPathCrossover(const std::vector<Curve>& curves, std::vector<std::string>& out) {
  const auto path = std::find_if(curves.begin(), curves.end(),
                                 [](const Curve& c) { return c.family == "path_traced"; });
  const auto view =
      std::find_if(curves.begin(), curves.end(), [](const Curve& c) { return c.family == "view"; });
  if (path == curves.end() || view == curves.end()) return;
  const std::vector<Crossover> found = crossovers({*view, *path});
  const double last = std::max(path->points.back().seconds, view->points.back().seconds);
  if (!found.empty()) {
    out.push_back(fmt::format("{} overtakes {} at {} a frame, at a relative error of {}.",
                              found.back().after, found.back().before, time(found.back().seconds),
                              percent(found.back().error)));
    return;
  }
  const auto a = errorAt(*view, last), b = errorAt(*path, last);
  if (a && b)
    out.push_back(fmt::format(
        "Within the times measured, up to {} a frame, {} stays below {}: {} against {}; {}",
        time(last), *a < *b ? view->title : path->title, *a < *b ? path->title : view->title,
        percent(std::min(*a, *b)), percent(std::max(*a, *b)),
        *a < *b ? "path tracing pays off beyond them alone."
                : "the photosphere does not pay here."));
}

// Where more photons stop helping.
void addBiasFloor(const SweepResult& sweep, const std::vector<Curve>& curves,
                  std::vector<std::string>& out) {
  for (const Curve& curve : curves) {
    if (!isPhotosphere(curve.family) || curve.points.empty()) continue;
    const PointResult* p = pointNamed(sweep, curve.points.back().label);
    if (!p) continue;
    const ErrorFigures& f = p->errors[kMultiple][kAllPixels];
    if (!(f.relMse.value > 0) || !(f.biasSquared.low > 0)) continue;
    const double share = f.biasSquared.value / f.relMse.value;
    if (share < 0.5) continue;
    out.push_back(fmt::format(
        "{}: {:.0f} % of its squared error is bias, which more photons at this radius do not "
        "remove; its mean is {:+.1f} % off.",
        p->label, std::min(100.0, 100 * share), 100 * (f.meanRatio.value - 1)));
  }
}

void addMemory(const SweepResult& sweep, std::vector<std::string>& out) {
  const PointResult *most = nullptr, *least = nullptr;
  for (const PointResult& p : sweep.points) {
    if (!most || p.peakMemoryBytes.median > most->peakMemoryBytes.median) most = &p;
    if (!least || p.peakMemoryBytes.median < least->peakMemoryBytes.median) least = &p;
  }
  if (!most || most == least) return;
  const auto bytes = [](const PointResult* p) {
    return formatBytes(static_cast<std::uint64_t>(p->peakMemoryBytes.median));
  };
  out.push_back(fmt::format("Peak memory ranges from {} ({}) to {} ({}).", bytes(least),
                            least->label, bytes(most), most->label));
}

void addHardCases(const StudyResult& result, std::vector<std::string>& out) {
  for (std::size_t i = 1; i < result.sweeps.size(); ++i) {
    const SweepResult& sweep = result.sweeps[i];
    for (const std::size_t layer : {kTotal, kMultiple}) {
      const Verdict v = verdictOf(sweep, layer);
      if (!v.known) continue;
      std::string path;
      if (v.paths.seconds > 0)
        path = fmt::format(" Paths would have the photosphere's error after about {} ({}).",
                           time(v.paths.seconds), v.paths.title);
      out.push_back(
          fmt::format("{} ({}), layer {}: at {} the photosphere {}: {} with {}, {} with {}.{}",
                      sweep.name, sweep.description, kLayers[layer], time(v.seconds),
                      v.rivalError < v.ourError ? "loses" : "holds", v.ours, percent(v.ourError),
                      v.rival, percent(v.rivalError), path));
    }
  }
}

// A reference that is too poor says so here.
void addReferenceChecks(const StudyResult& result, std::vector<std::string>& out) {
  for (const SweepResult& sweep : result.sweeps) {
    const double spread = sweep.reference.pathNoise[kMultiple];
    const double claimed = sweep.reference.noise[kMultiple];
    if (spread > 3 * claimed)
      out.push_back(fmt::format(
          "{}: the reference is not to be relied on in layer multiple: from the spread of "
          "contenders like it its relMSE should be about {:.2g}, where its own halves say {:.2g}; "
          "rare "
          "bright paths are still missing. Give it more --minutes.",
          sweep.name, spread, claimed));
    else if (!sweep.reference.quiet)
      out.push_back(fmt::format(
          "{}: the reference's noise (relMSE {:.2g} in layer multiple) is above a tenth "
          "of the best contender's error; it is subtracted, but more --minutes would "
          "make it surer.",
          sweep.name, std::max(spread, claimed)));
    else if (!sweep.reference.settled)
      out.push_back(fmt::format(
          "{}: the reference may still lack rare bright paths: it has not been seen that twice as "
          "many paths show the contenders no better. More --minutes would tell.",
          sweep.name));
  }
}

void addFlicker(const StudyResult& result, std::vector<std::string>& out) {
  for (const char* sequence : {"still", "moving"}) {
    const FlickerRow* best = nullptr;
    for (const FlickerRow& row : result.flicker)
      if (row.sequence == sequence && row.seedPerFrame &&
          (!best || row.relMse.value < best->relMse.value))
        best = &row;
    if (!best) continue;
    out.push_back(fmt::format(
        "The {} sequence flickers least with {}: {} from frame to frame with a new seed a frame.",
        sequence, best->label, percent(std::sqrt(std::max(0.0, best->relMse.value)))));
  }
  const bool still = std::any_of(result.flicker.begin(), result.flicker.end(), [](const auto& row) {
    return row.sequence == "still" && !row.seedPerFrame && row.relMse.value == 0;
  });
  if (still)
    out.emplace_back(
        "seed_per_frame = false holds the noise of a still scene exactly still; where the smoke "
        "moves it does what the table shows.");
}

// Which basis a light cache should hold, by g.
void addBases(const StudyResult& result, std::vector<std::string>& out) {
  std::string parts;
  for (const SweepResult& sweep : result.bases) {
    const PointResult *best = nullptr, *view = nullptr;
    const auto error = [](const PointResult& p) {
      return relativeError(p.errors[kMultiple][kAllPixels]);
    };
    for (const PointResult& p : sweep.points) {
      if (p.family == "view") view = &p;
      if (isCacheable(p) && (!best || error(p) < error(*best))) best = &p;
    }
    if (!best || !view) continue;
    parts += fmt::format("{}{}: {} ({}; view {})", parts.empty() ? "" : "; ", sweep.name,
                         familyTitle(best->family), percent(error(*best)), percent(error(*view)));
  }
  if (!parts.empty())
    out.push_back(
        "Of the bases that a light cache can hold, the least error at equal photons has " + parts +
        ".");
}

}  // namespace

Verdict verdictOf(const SweepResult& sweep, std::size_t layer) {
  Verdict verdict;
  const std::vector<Curve> curves = curvesOf(sweep, layer, kAllPixels);
  for (const Curve& curve : curves)
    if (isPhotosphere(curve.family))
      verdict.seconds = std::max(verdict.seconds, curve.points.back().seconds);
  const Best ours =
      bestAt(curves, verdict.seconds, [](const Curve& c) { return isPhotosphere(c.family); });
  const Best rival =
      bestAt(curves, verdict.seconds, [](const Curve& c) { return !isPhotosphere(c.family); });
  if (!ours.curve || !rival.curve) return verdict;
  verdict.ours = ours.curve->title;
  verdict.rival = rival.curve->title;
  verdict.ourError = ours.error;
  verdict.rivalError = rival.error;
  verdict.known = true;
  verdict.paths = pathTimeFor(curves, ours.error);
  return verdict;
}

PathTime pathTimeFor(const std::vector<Curve>& curves, double error) {
  PathTime best;
  if (!(error > 0)) return best;
  for (const Curve& curve : curves) {
    if (!isPaths(curve.family)) continue;
    const CurvePoint& last = curve.points.back();
    const double seconds = last.seconds * std::pow(last.error / error, 2);
    if (best.title.empty() || seconds < best.seconds) best = {curve.title, seconds};
  }
  return best;
}

bool isCacheable(const PointResult& point) {
  return point.lightMemoryBytes > 0 && point.family != "view";
}

std::vector<std::string> advice(const StudyResult& result) {
  std::vector<std::string> out;
  if (result.sweeps.empty()) return out;
  const SweepResult& sweep = result.sweeps.front();
  const std::vector<Curve> curves = curvesOf(sweep, kMultiple, kAllPixels);
  addBestByTime(curves, out);
  addPathCrossover(curves, out);
  addBiasFloor(sweep, curves, out);
  addMemory(sweep, out);
  addHardCases(result, out);
  addBases(result, out);
  addFlicker(result, out);
  addReferenceChecks(result, out);
  return out;
}

}  // namespace photosphere::study
