#include "reconstruction.h"

#include <cmath>

namespace photosphere::sphere {

namespace {

using Matrix = std::vector<double>;

// Gaussian width over the spacing of bin centres: narrower shows the bins, wider needs more
// sharpening.
constexpr double kWidth = 0.6;
constexpr int kSide = 4;  // points along a side of a cell for its mean

// Adds the basis functions' values at a direction, times `weight`, to a row.
void addBasis(const Partition& bins, const Vec3f& w, double weight, double* row) {
  const auto count = static_cast<std::size_t>(bins.size());
  const double spacing2 = 4 * kPi / static_cast<double>(count);
  std::vector<double> values(count);
  double sum = 0;
  for (std::size_t j = 0; j < count; ++j) {
    const Vec3d d = Vec3d(w) - Vec3d(bins.center(static_cast<int>(j)));
    values[j] = std::exp(-0.5 * glm::dot(d, d) / (kWidth * kWidth * spacing2));
    sum += values[j];
  }
  for (std::size_t j = 0; j < count; ++j)
    row[j] += weight * values[j] / sum;
}

// Mean of every basis function over every cell, [cell][bin].
Matrix cellMeans(const Partition& bins, const Partition& cells) {
  const auto columns = static_cast<std::size_t>(bins.size());
  Matrix means(static_cast<std::size_t>(cells.size()) * columns, 0.0);
  for (int cell = 0; cell < cells.size(); ++cell)
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        addBasis(bins, cells.point(cell, Vec2d(x + 0.5, y + 0.5) / static_cast<double>(kSide)),
                 1.0 / (kSide * kSide), &means[static_cast<std::size_t>(cell) * columns]);
  return means;
}

Matrix multiply(const Matrix& a, const Matrix& b, std::size_t n) {
  Matrix c(a.size(), 0.0);
  for (std::size_t i = 0; i < a.size() / n; ++i)
    for (std::size_t k = 0; k < n; ++k) {
      const double v = a[i * n + k];
      for (std::size_t j = 0; j < n; ++j)
        c[i * n + j] += v * b[k * n + j];
    }
  return c;
}

}  // namespace

std::vector<double> smoothReconstruction(const Partition& bins, const Partition& fine) {
  const auto n = static_cast<std::size_t>(bins.size());
  Matrix residual = cellMeans(bins, bins);  // I - A
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      residual[i * n + j] = (i == j ? 1.0 : 0.0) - residual[i * n + j];
  // (I + R)(I + R^2) = I + R + R^2 + R^3, the first terms of the inverse of A = I - R.
  Matrix square = multiply(residual, residual, n), once = residual;
  for (std::size_t i = 0; i < n; ++i) {
    square[i * n + i] += 1.0;
    once[i * n + i] += 1.0;
  }
  Matrix spread = multiply(cellMeans(bins, fine), multiply(once, square, n), n);
  for (std::size_t j = 0; j < n; ++j) {
    double sum = 0;
    for (std::size_t i = j; i < spread.size(); i += n)
      sum += spread[i];
    for (std::size_t i = j; i < spread.size(); i += n)
      spread[i] /= sum;
  }
  return spread;
}

}  // namespace photosphere::sphere
