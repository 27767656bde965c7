#include "photosphere/estimators/smoothed_phase.h"

#include <algorithm>
#include <cmath>

#include "photosphere/core/error.h"
#include "photosphere/core/parallel.h"

namespace photosphere::estimators {

namespace {

// Degrees of the Legendre series at most; beyond, a phase function of |g| = 0.998 has under 1e-4 of
// its coefficient left, and the kernel's own fall off besides.
constexpr int kMostDegrees = 4096;

// Degrees that a phase function g^l needs to 1e-7.
int degreesFor(double g) {
  const double a = std::abs(g);
  if (a < 1e-7) return 1;
  return std::clamp(static_cast<int>(std::ceil(std::log(1e-7) / std::log(a))), 2, kMostDegrees);
}

// Calls visit(l, P_l(x)) for l = 0 .. count - 1.
template <class Visit>
void forEachLegendre(double x, int count, const Visit& visit) {
  double before = 0, now = 1;
  for (int l = 0; l < count; ++l) {
    visit(l, now);
    const double next = ((2 * l + 1) * x * now - l * before) / (l + 1);
    before = now;
    now = next;
  }
}

// Legendre coefficients of a kernel, the first of them 1: its integral over the sphere.
std::vector<double> kernelCoefficients(const std::function<double(double)>& kernel, double support,
                                       int count) {
  // P_l oscillates l times over pi: the midpoint rule takes eight points to a wave.
  const int points = std::max(1024, static_cast<int>(8.0 * count * support / kPi));
  std::vector<double> coefficients(static_cast<std::size_t>(count), 0.0);
  for (int i = 0; i < points; ++i) {
    const double angle = (i + 0.5) * support / points;
    const double weight = kernel(angle) * std::sin(angle);
    forEachLegendre(std::cos(angle), count, [&](int l, double p) {
      coefficients[static_cast<std::size_t>(l)] += weight * p;
    });
  }
  const double whole = coefficients[0];
  if (!(whole > 0))
    throw ConfigError("estimator.kernel: bandwidth and truncation leave nothing of the kernel");
  for (double& c : coefficients)
    c /= whole;
  return coefficients;
}

}  // namespace

SmoothedPhase::SmoothedPhase(const phase::HenyeyGreenstein& phase,
                             const std::function<double(double)>& kernel, double support)
    : m_table(kSteps + 1) {
  // On the sphere the convolution of two zonal functions multiplies their Legendre coefficients;
  // those of Henyey-Greenstein are g^l.
  std::vector<double> series =
      kernelCoefficients(kernel, std::min(support, kPi), degreesFor(phase.g()));
  double power = 1;
  for (std::size_t l = 0; l < series.size(); ++l) {
    series[l] *= power * (2.0 * static_cast<double>(l) + 1.0) / (4.0 * kPi);
    power *= phase.g();
  }
  parallelFor(m_table.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double s = static_cast<double>(i) / kSteps;
      double sum = 0;
      forEachLegendre(1 - 2 * s * s, static_cast<int>(series.size()),
                      [&](int l, double p) { sum += series[static_cast<std::size_t>(l)] * p; });
      m_table[i] = static_cast<float>(std::max(0.0, sum));
    }
  });
}

}  // namespace photosphere::estimators
