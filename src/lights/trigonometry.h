#pragma once
// Sine and arc sine in double with the same bits on every CPU: photon powers and directions depend
// on them, and the C library picks its variant by CPU. Only +, -, *, / and sqrt.

#include <cmath>

#include "photosphere/core/exact_sine.h"

namespace photosphere::lights {

/// 1 - cos(x) for x in [0, pi], without cancellation for small x.
inline double oneMinusCos(double x) {
  const double s = exactSin(x / 2);
  return 2 * s * s;
}

/// asin(x) for x in [0, 1]. Halving the angle four times leaves an argument below 0.1, where six
/// terms of the series reach double precision.
inline double exactAsin(double x) {
  for (int i = 0; i < 4; ++i)
    x /= std::sqrt(2 * (1 + std::sqrt(glm::max(0.0, (1 - x) * (1 + x)))));
  const double z = x * x;
  double sum = 231.0 / 13312;
  sum = sum * z + 63.0 / 2816;
  sum = sum * z + 35.0 / 1152;
  sum = sum * z + 5.0 / 112;
  sum = sum * z + 3.0 / 40;
  sum = sum * z + 1.0 / 6;
  return 16 * (x + x * z * sum);
}

/// acos(x) for x in [-1, 1]; values outside count as the ends.
inline double exactAcos(double x) {
  const double half = 0.5 * (1 - glm::clamp(x, -1.0, 1.0));
  return 2 * exactAsin(std::sqrt(half));
}

/// The angle [rad] whose 1 - cos is `h`, in [0, pi].
inline double angleFromOneMinusCos(double h) {
  return 2 * exactAsin(std::sqrt(glm::clamp(h / 2, 0.0, 1.0)));
}

}  // namespace photosphere::lights
