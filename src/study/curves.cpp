#include "curves.h"

#include <algorithm>
#include <cmath>

#include "contenders.h"
#include "photosphere/core/types.h"

namespace photosphere::study {

namespace {

/// Smallest relative error that a plot shows.
constexpr double kLeastError = 1e-6;

CurvePoint pointOf(const PointResult& p, std::size_t layer, std::size_t region) {
  const ErrorFigures& f = p.errors[layer][region];
  const auto root = [](double v) { return std::sqrt(std::max(v, kLeastError * kLeastError)); };
  CurvePoint point;
  point.seconds = p.seconds.total.median;
  point.secondsMin = p.seconds.total.min;
  point.secondsMax = p.seconds.total.max;
  point.error = root(f.relMse.value > 0 ? f.relMse.value : f.relMse.high);
  point.low = std::isfinite(f.relMse.low) ? root(f.relMse.low) : point.error;
  point.high = std::isfinite(f.relMse.high) ? root(f.relMse.high) : point.error;
  point.label = p.label;
  point.work = p.work;
  return point;
}

bool dominates(const CurvePoint& a, const CurvePoint& b) {
  return a.seconds <= b.seconds && a.error <= b.error &&
         (a.seconds < b.seconds || a.error < b.error);
}

void markFront(std::vector<Curve>& curves) {
  for (Curve& curve : curves)
    for (CurvePoint& point : curve.points) {
      point.onFront = true;
      for (const Curve& other : curves)
        for (const CurvePoint& rival : other.points)
          if (dominates(rival, point)) point.onFront = false;
    }
}

double between(double x, double x0, double x1, double y0, double y1) {
  if (!(x1 > x0)) return std::min(y0, y1);
  const double t = std::log(x / x0) / std::log(x1 / x0);
  return y0 * std::pow(y1 / y0, t);
}

// Times at which two curves must be compared: their knots within what both cover.
std::vector<double> sharedKnots(const Curve& a, const Curve& b) {
  const double from = std::max(a.points.front().seconds, b.points.front().seconds);
  const double to = std::max(a.points.back().seconds, b.points.back().seconds);
  std::vector<double> knots{from};
  for (const Curve* curve : {&a, &b})
    for (const CurvePoint& p : curve->points)
      if (p.seconds > from && p.seconds <= to) knots.push_back(p.seconds);
  std::sort(knots.begin(), knots.end());
  return knots;
}

void addCrossovers(const Curve& a, const Curve& b, std::vector<Crossover>& out) {
  if (a.points.empty() || b.points.empty()) return;
  const std::vector<double> knots = sharedKnots(a, b);
  const auto gap = [&](double t) { return std::log(*errorAt(a, t) / *errorAt(b, t)); };
  double before = knots.front(), gapBefore = gap(before);
  for (const double knot : knots) {
    const double gapHere = gap(knot);
    if (gapHere == 0) continue;  // they touch here: what follows says whether they cross
    if (gapBefore * gapHere < 0) {
      double low = before, high = knot;
      for (int step = 0; step < 60; ++step) {
        const double middle = std::sqrt(low * high);
        (gap(middle) * gapBefore > 0 ? low : high) = middle;
      }
      out.push_back({gapBefore < 0 ? a.title : b.title, gapBefore < 0 ? b.title : a.title, low,
                     *errorAt(a, low)});
    }
    before = knot;
    gapBefore = gapHere;
  }
}

// Round numbers within the range of one coordinate of all points.
std::vector<double> roundNumbersAround(const std::vector<Curve>& curves,
                                       double CurvePoint::*coordinate) {
  double low = 1e300, high = 0;
  for (const Curve& curve : curves)
    for (const CurvePoint& p : curve.points) {
      low = std::min(low, p.*coordinate);
      high = std::max(high, p.*coordinate);
    }
  std::vector<double> numbers;
  for (int decade = -9; decade <= 9; ++decade)
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double value = digit * std::pow(10.0, decade);
      if (value >= low && value <= high) numbers.push_back(value);
    }
  return numbers;
}

}  // namespace

std::vector<Curve> curvesOf(const SweepResult& sweep, std::size_t layer, std::size_t region) {
  std::vector<Curve> curves;
  for (const PointResult& p : sweep.points) {
    // Single scattering alone says nothing of the other: black is no estimate of it.
    if (layer == kMultiple && p.family == "single") continue;
    // It also renders what it judges itself by, and has a table of its own.
    if (p.family == "until_error") continue;
    auto found = std::find_if(curves.begin(), curves.end(),
                              [&](const Curve& c) { return c.family == p.family; });
    if (found == curves.end())
      found = curves.insert(curves.end(), {p.family, familyTitle(p.family), {}});
    found->points.push_back(pointOf(p, layer, region));
  }
  for (Curve& curve : curves)
    std::stable_sort(
        curve.points.begin(), curve.points.end(),
        [](const CurvePoint& a, const CurvePoint& b) { return a.seconds < b.seconds; });
  markFront(curves);
  return curves;
}

std::optional<double> errorAt(const Curve& curve, double seconds) {
  if (curve.points.empty() || seconds < curve.points.front().seconds) return std::nullopt;
  double best = curve.points.front().error;
  for (std::size_t i = 0; i + 1 < curve.points.size(); ++i) {
    const CurvePoint &a = curve.points[i], &b = curve.points[i + 1];
    best = std::min(best, a.error);
    if (seconds < b.seconds)
      return std::min(best, between(seconds, a.seconds, b.seconds, a.error, b.error));
  }
  return std::min(best, curve.points.back().error);
}

std::optional<double> secondsFor(const Curve& curve, double error) {
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    const CurvePoint& b = curve.points[i];
    if (b.error > error) continue;
    if (i == 0) return b.seconds;
    const CurvePoint& a = curve.points[i - 1];
    return between(error, b.error, a.error, b.seconds, a.seconds);
  }
  return std::nullopt;
}

std::vector<Crossover> crossovers(const std::vector<Curve>& curves) {
  std::vector<Crossover> out;
  for (std::size_t i = 0; i < curves.size(); ++i)
    for (std::size_t j = i + 1; j < curves.size(); ++j)
      addCrossovers(curves[i], curves[j], out);
  std::stable_sort(out.begin(), out.end(),
                   [](const Crossover& a, const Crossover& b) { return a.seconds < b.seconds; });
  return out;
}

std::vector<double> roundTimes(const std::vector<Curve>& curves) {
  return roundNumbersAround(curves, &CurvePoint::seconds);
}

std::vector<double> roundErrors(const std::vector<Curve>& curves) {
  std::vector<double> errors = roundNumbersAround(curves, &CurvePoint::error);
  std::reverse(errors.begin(), errors.end());
  return errors;
}

}  // namespace photosphere::study
