#include "photosphere/sphere/zonal.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "photosphere/core/parallel.h"

namespace photosphere::sphere {

namespace {

constexpr double kNothing = 1e-7;

// Moments of `value(angle)` on [0, end]: 2 pi * integral of value P_l(cos t) sin t dt, composite
// Gauss-Legendre with three points in each of `panels` panels.
template <class Value>
LegendreMoments integrateMoments(std::size_t count, double end, std::size_t panels,
                                 const Value& value) {
  constexpr double nodes[] = {-0.38729833462074169, 0.0, 0.38729833462074169};
  constexpr double weights[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  const double width = end / static_cast<double>(panels);
  LegendreMoments moments(count, 0.0);
  for (std::size_t i = 0; i < panels; ++i)
    for (int k = 0; k < 3; ++k) {
      const double t = (static_cast<double>(i) + 0.5 + nodes[k]) * width;
      const double c = std::cos(t);
      const double part = 2 * kPi * weights[k] * width * std::sin(t) * value(t);
      double previous = 1, current = c;
      moments[0] += part;
      for (std::size_t l = 1; l < count; ++l) {
        moments[l] += part * current;
        const auto n = static_cast<double>(l);
        const double next = ((2 * n + 1) * c * current - n * previous) / (n + 1);
        previous = current;
        current = next;
      }
    }
  return moments;
}

// Degrees below the last one that matters.
std::size_t significant(const LegendreMoments& moments) {
  std::size_t count = moments.size();
  while (count > 1 && std::abs(moments[count - 1]) < kNothing)
    --count;
  return count;
}

// Of degrees below `count`, at a cosine: 4 pi times the function that has these moments alone.
double seriesAt(const LegendreMoments& moments, std::size_t count, double c) {
  double previous = 1, current = c, sum = moments[0];
  for (std::size_t l = 1; l < count; ++l) {
    const auto n = static_cast<double>(l);
    sum += (2 * n + 1) * moments[l] * current;
    const double next = ((2 * n + 1) * c * current - n * previous) / (n + 1);
    previous = current;
    current = next;
  }
  return sum;
}

// Least value over its mean of the function that has these moments alone.
double leastValue(const LegendreMoments& moments) {
  const int angles = 32 * static_cast<int>(moments.size());
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= angles; ++i)
    least = std::min(least, seriesAt(moments, moments.size(), std::cos(kPi * i / angles)));
  return least / moments[0];
}

}  // namespace

LegendreMoments kernelMoments(const SmoothingKernel& kernel, std::size_t count) {
  if (!kernel.acts()) return LegendreMoments(count, 1.0);
  LegendreMoments moments = integrateMoments(
      count, static_cast<double>(kernel.support()), std::max<std::size_t>(count, 64),
      [&](double t) { return static_cast<double>(kernel.atAngle(static_cast<float>(t))); });
  const double scale = 1.0 / moments[0];
  for (double& m : moments)
    m *= scale;
  return moments;
}

LegendreMoments convolved(const LegendreMoments& a, const LegendreMoments& b) {
  LegendreMoments product(std::min(a.size(), b.size()));
  for (std::size_t l = 0; l < product.size(); ++l)
    product[l] = a[l] * b[l];
  return product;
}

LegendreMoments cutAt(const LegendreMoments& moments, int order, double dip) {
  LegendreMoments cut(static_cast<std::size_t>(order) + 1, 0.0);
  std::copy_n(moments.begin(), std::min(moments.size(), cut.size()), cut.begin());
  const auto spread = [&cut](double time) {
    LegendreMoments out = cut;
    for (std::size_t l = 0; l < out.size(); ++l)
      out[l] *= std::exp(-time * static_cast<double>(l * (l + 1)));
    return out;
  };
  if (leastValue(cut) >= -dip) return cut;
  // After a time of 1 degree 1 is left with an eighth, and nothing dips.
  double early = 0, late = 1;
  for (int i = 0; i < 20; ++i) {
    const double time = 0.5 * (early + late);
    (leastValue(spread(time)) >= -dip ? late : early) = time;
  }
  return spread(late);
}

ZonalTable::ZonalTable(const LegendreMoments& moments) {
  const std::size_t count = significant(moments);
  const std::size_t intervals = std::max<std::size_t>(128, 8 * count);
  m_scale = static_cast<float>(static_cast<double>(intervals) / kPi);
  m_meanCosine = count > 1 ? moments[1] : 0.0;
  m_values.resize(intervals + 2);
  parallelFor(intervals + 1, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double c = std::cos(kPi * static_cast<double>(i) / static_cast<double>(intervals));
      const double sum = seriesAt(moments, count, c);
      m_values[i] = static_cast<float>(std::max(0.0, sum / (4 * kPi)));
    }
  });
  m_values.back() = m_values[intervals];
}

namespace {

// Factor of 1 - g R from one table of LobeTable to the next.
constexpr double kLogStep = 0.08;

}  // namespace

LobeTable::LobeTable(const LegendreMoments& phase) {
  // How fast the moments fall says how narrow the lobe is, whatever the phase function's shape.
  m_g = std::clamp(1.0 - 16.0 / static_cast<double>(std::max<std::size_t>(significant(phase), 20)),
                   0.2, 0.996);
  const double log = std::log(1.0 - m_g);
  const int rows = std::max(12, static_cast<int>(std::ceil(-log / kLogStep)));
  m_rows = static_cast<float>(rows);
  m_inverseLog = static_cast<float>(rows / log);
  for (int i = 0; i <= rows; ++i) {
    const double concentration = i == rows ? 1.0 : (1.0 - std::exp(log * i / rows)) / m_g;
    LegendreMoments moments = phase;
    double power = 1.0;
    for (double& m : moments) {
      m *= power;
      power *= concentration;
    }
    m_tables.emplace_back(moments);
  }
}

float LobeTable::operator()(float concentration, const Vec3f& mean, const Vec3f& wo) const {
  const float r = glm::clamp(concentration, 0.0f, 1.0f);
  const float x =
      glm::clamp(std::log(1.0f - static_cast<float>(m_g) * r) * m_inverseLog, 0.0f, m_rows);
  const auto i = std::min(static_cast<std::size_t>(x), m_tables.size() - 2);
  const float f = x - static_cast<float>(i);
  const float angle = angleBetween(mean, wo);
  const float low = m_tables[i].atAngle(angle);
  return low + (m_tables[i + 1].atAngle(angle) - low) * f;
}

}  // namespace photosphere::sphere
