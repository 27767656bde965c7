#include "photosphere/sphere/smoothing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "directions.h"
#include "photosphere/core/error.h"
#include "photosphere/core/exact_sine.h"
#include "photosphere/core/fast_math.h"

namespace photosphere::sphere {

namespace {

// asin for x in [0, 1/2]; polynomial: Cephes asinf (S. Moshier), public domain.
float smallArcSine(float x) {
  const float z = x * x;
  float p = 4.2163199048e-2f;
  p = p * z + 2.4181311049e-2f;
  p = p * z + 4.5470025998e-2f;
  p = p * z + 7.4953002686e-2f;
  p = p * z + 1.6666752422e-1f;
  return p * z * x + x;
}

// Where a gaussian is below the rounding of its own sum.
constexpr double kFarthest = 9.0;

}  // namespace

float angleBetween(const Vec3f& a, const Vec3f& b) {
  const Vec3f d = a - b;
  const float s = std::min(1.0f, 0.5f * std::sqrt(glm::dot(d, d)));
  if (s <= 0.5f) return 2.0f * smallArcSine(s);
  // Past a third of a turn the chord to the antipode is the one with digits.
  const Vec3f e = a + b;
  const float c = std::min(1.0f, 0.5f * std::sqrt(glm::dot(e, e)));
  if (c <= 0.5f) return static_cast<float>(kPi) - 2.0f * smallArcSine(c);
  return static_cast<float>(kPi) - 4.0f * smallArcSine(std::sqrt(0.5f * (1.0f - s)));
}

SmoothingKernel::SmoothingKernel(AngularKernel kind, double bandwidth, double truncation)
    : m_kind(kind) {
  if (kind == AngularKernel::none) return;
  if (!(bandwidth >= 1e-4) || !(bandwidth <= 1e4))
    throw ConfigError(
        fmt::format("bandwidth = {}: a kernel over directions needs 0.0001 to 10000 "
                    "radians",
                    bandwidth));
  if (!(truncation > 0))
    throw ConfigError(fmt::format(
        "truncation = {}: a kernel that is cut at its centre holds nothing; use more than 0",
        truncation));
  const double reach = kind == AngularKernel::epanechnikov
                           ? bandwidth * std::min(1.0, truncation)
                           : bandwidth * std::min(kFarthest, truncation);
  m_support = static_cast<float>(std::min(kPi, reach));
  m_inverseBandwidth = static_cast<float>(1.0 / bandwidth);
  // Composite Gauss-Legendre, three points a panel: exact to the rounding of `shape`.
  constexpr int panels = 64;
  constexpr double nodes[] = {-0.38729833462074169, 0.0, 0.38729833462074169};
  constexpr double weights[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  const double width = static_cast<double>(m_support) / panels;
  double sum = 0;
  for (int i = 0; i < panels; ++i)
    for (int k = 0; k < 3; ++k) {
      const double t = (i + 0.5 + nodes[k]) * width;
      sum += weights[k] * static_cast<double>(shape(static_cast<float>(t))) *
             exactSin(t <= kPi / 2 ? t : kPi - t);
    }
  m_scale = static_cast<float>(1.0 / (2 * kPi * width * sum));
}

float SmoothingKernel::shape(float angle) const {
  const float x = angle * m_inverseBandwidth;
  if (m_kind == AngularKernel::gaussian) return fastExp(-0.5f * x * x);
  return std::max(0.0f, 1.0f - x * x);
}

namespace {

// A cell in the coordinates of its octant in which area is even: (1 - z, azimuth).
struct Rectangle {
  Rectangle(const Partition& partition, int cell) {
    const double rows = partition.rows();
    const int local = partition.mirrored(cell), row = rowOf(local), columns = 2 * row + 1;
    low = {row * row / (rows * rows), static_cast<double>(local - row * row) / columns};
    high = {(row + 1) * (row + 1) / (rows * rows),
            static_cast<double>(local - row * row + 1) / columns};
  }
  double area() const { return (high.x - low.x) * (high.y - low.y); }
  Vec2d low, high;
};

// Part of a bin that lies in a cell.
double overlap(const Partition& bins, int bin, const Partition& cells, int cell) {
  if (bins.octant(bin) != cells.octant(cell)) return 0.0;
  const Rectangle a(bins, bin), b(cells, cell);
  const Vec2d shared = glm::min(a.high, b.high) - glm::max(a.low, b.low);
  return std::max(0.0, shared.x) * std::max(0.0, shared.y) / a.area();
}

}  // namespace

std::vector<double> smoothingMatrix(const Partition& bins, const Partition& cells,
                                    const SmoothingKernel& kernel) {
  const auto columns = static_cast<std::size_t>(bins.size());
  const auto rows = static_cast<std::size_t>(cells.size());
  std::vector<double> matrix(rows * columns, 0.0);
  for (std::size_t j = 0; j < columns; ++j) {
    const int bin = static_cast<int>(j);
    const Vec3f source = bins.center(bin);
    double sum = 0;
    for (std::size_t k = 0; k < rows; ++k) {
      const int cell = static_cast<int>(k);
      const double value = kernel.acts() ? static_cast<double>(kernel(cells.center(cell), source))
                                         : overlap(bins, bin, cells, cell);
      matrix[k * columns + j] = value;
      sum += value;
    }
    if (!(sum > 0)) {
      matrix[static_cast<std::size_t>(cells.index(source)) * columns + j] = 1.0;
      continue;
    }
    for (std::size_t k = 0; k < rows; ++k)
      matrix[k * columns + j] /= sum;
  }
  return matrix;
}

}  // namespace photosphere::sphere
