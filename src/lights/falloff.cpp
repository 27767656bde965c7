#include "falloff.h"

#include <array>

namespace photosphere::lights {

namespace {

/// The part of a circle at angle theta about one axis that lies in a cone about another axis.
/// All angles as 1 - cos. Spherical law of cosines, written so that small angles do not cancel.
double fractionInside(double theta, double between, double cone) {
  const double numerator = between + theta - between * theta - cone;
  const double squared = between * (2 - between) * theta * (2 - theta);
  if (squared <= 0) return numerator <= 0 ? 1.0 : 0.0;
  return exactAcos(numerator / std::sqrt(squared)) / kPi;
}

}  // namespace

double sharedSolidAngle(const Falloff& falloff, const Vec3d& axis, const Cone& cone, int nodes) {
  const double between = oneMinusCosBetween(axis, cone.axis);
  const double gamma = angleFromOneMinusCos(between);
  const double beta = angleFromOneMinusCos(cone.oneMinusCos);
  const bool whole = cone.oneMinusCos >= 2.0;
  const double end = std::min(kPi, falloff.angle());
  std::array<double, 6> ends{0.0,          falloff.fullAngle(),    std::abs(gamma - beta),
                             gamma + beta, 2 * kPi - gamma - beta, end};
  for (double& angle : ends)
    angle = std::clamp(angle, 0.0, end);
  std::sort(ends.begin(), ends.end());
  double sum = 0;
  for (std::size_t piece = 0; piece + 1 < ends.size(); ++piece) {
    const double width = ends[piece + 1] - ends[piece];
    if (width <= 0) continue;
    for (int i = 0; i < nodes; ++i) {
      const double t = (i + 0.5) / nodes;
      const double theta = ends[piece] + width * t * t * t * (10 + t * (6 * t - 15));
      const double h = oneMinusCos(theta);
      const double inside = whole ? 1.0 : fractionInside(h, between, cone.oneMinusCos);
      if (inside <= 0) continue;
      const double sine = std::sqrt(std::max(0.0, h * (2 - h)));
      const double slope = 30 * t * t * (1 - t) * (1 - t);
      sum += falloff(h) * inside * 2 * kPi * sine * width * slope / nodes;
    }
  }
  return sum;
}

}  // namespace photosphere::lights
