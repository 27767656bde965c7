#pragma once
// Error against time as curves: Pareto front, equal time, equal error, crossovers.

#include <optional>
#include <string>
#include <vector>

#include "photosphere/study/result.h"

namespace photosphere::study {

struct CurvePoint {
  double seconds = 0, secondsMin = 0, secondsMax = 0;  ///< of a frame
  double error = 0, low = 0, high = 0;                 ///< relative error [1], 95 % interval
  std::string label;
  std::int64_t work = 0;
  bool onFront = false;  ///< no other point of the sweep is both faster and better
};

/// The points of one family, fastest first.
struct Curve {
  std::string family, title;
  std::vector<CurvePoint> points;
};

/// Points whose error came out at or below 0 (within the noise) take the upper end of their
/// interval as their error, so that they have a place on a logarithmic axis.
std::vector<Curve> curvesOf(const SweepResult& sweep, std::size_t layer, std::size_t region);

/// Error of a family that is given so many seconds: straight in log error over log seconds between
/// its points; beyond the slowest, that of its best point. Nothing before the fastest.
std::optional<double> errorAt(const Curve& curve, double seconds);
/// Seconds after which a family's error first falls to `error`. Nothing where it never does.
std::optional<double> secondsFor(const Curve& curve, double error);

/// Where one family overtakes another.
struct Crossover {
  std::string before, after;  ///< titles of who is better before and after
  double seconds = 0, error = 0;
};
std::vector<Crossover> crossovers(const std::vector<Curve>& curves);

/// Round times (1, 2, 5 times powers of ten) between the fastest and the slowest point.
std::vector<double> roundTimes(const std::vector<Curve>& curves);
/// Round errors between the worst and the best point, worst first.
std::vector<double> roundErrors(const std::vector<Curve>& curves);

}  // namespace photosphere::study
