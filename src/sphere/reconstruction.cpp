#include "reconstruction.h"

#include <cmath>

namespace photosphere::sphere {

namespace {

using Matrix = std::vector<double>;

// Gaussian width over the spacing of bin centres: narrower shows the bins, wider needs more
// sharpening.
constexpr double kWidth = 0.6;
constexpr int kSide = 4;  // points along a side of a cell for its mean

// Writes the basis functions' values at a direction.
void basisAt(const Partition& bins, const Vec3f& w, std::vector<double>& values) {
  const double spacing2 = 4 * kPi / static_cast<double>(values.size());
  double sum = 0;
  for (std::size_t j = 0; j < values.size(); ++j) {
    const Vec3d d = Vec3d(w) - Vec3d(bins.center(static_cast<int>(j)));
    values[j] = std::exp(-0.5 * glm::dot(d, d) / (kWidth * kWidth * spacing2));
    sum += values[j];
  }
  for (double& v : values)
    v /= sum;
}

// Calls visit(cell, direction) for points that stand for equal areas of every cell.
template <class Visit>
void forEachPoint(const Partition& cells, const Visit& visit) {
  for (int cell = 0; cell < cells.size(); ++cell)
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        visit(static_cast<std::size_t>(cell),
              cells.point(cell, Vec2d(x + 0.5, y + 0.5) / static_cast<double>(kSide)));
}

// Mean of every basis function over every cell, [cell][bin].
Matrix cellMeans(const Partition& bins, const Partition& cells) {
  const auto columns = static_cast<std::size_t>(bins.size());
  Matrix means(static_cast<std::size_t>(cells.size()) * columns, 0.0);
  std::vector<double> values(columns);
  forEachPoint(cells, [&](std::size_t cell, const Vec3f& w) {
    basisAt(bins, w, values);
    for (std::size_t j = 0; j < columns; ++j)
      means[cell * columns + j] += values[j] / (kSide * kSide);
  });
  return means;
}

// What each bin is given of each basis function's light, [bin][basis], over the area of a bin.
Matrix depositedMeans(const BinShares& deposit) {
  const Partition& bins = deposit.partition();
  const auto columns = static_cast<std::size_t>(bins.size());
  Matrix means(columns * columns, 0.0);
  std::vector<double> values(columns);
  std::vector<BinShare> shares(static_cast<std::size_t>(deposit.maxShares()));
  forEachPoint(bins, [&](std::size_t, const Vec3f& w) {
    basisAt(bins, w, values);
    const int count = deposit.shares(w, shares.data());
    for (int i = 0; i < count; ++i) {
      const BinShare& share = shares[static_cast<std::size_t>(i)];
      double* row = &means[static_cast<std::size_t>(share.bin) * columns];
      for (std::size_t j = 0; j < columns; ++j)
        row[j] += static_cast<double>(share.weight) * values[j] / (kSide * kSide);
    }
  });
  return means;
}

// Scales every column to the sum 1.
void normaliseColumns(Matrix& m, std::size_t n) {
  for (std::size_t j = 0; j < n; ++j) {
    double sum = 0;
    for (std::size_t i = j; i < m.size(); i += n)
      sum += m[i];
    for (std::size_t i = j; i < m.size(); i += n)
      m[i] /= sum;
  }
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

std::vector<double> smoothReconstruction(const BinShares& deposit, const Partition& fine) {
  const Partition& bins = deposit.partition();
  const auto n = static_cast<std::size_t>(bins.size());
  Matrix residual = depositedMeans(deposit);  // I - A
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
  normaliseColumns(spread, n);
  return spread;
}

std::vector<double> depositReconstruction(const BinShares& deposit, const Partition& fine) {
  const auto n = static_cast<std::size_t>(deposit.partition().size());
  Matrix spread(static_cast<std::size_t>(fine.size()) * n, 0.0);
  std::vector<BinShare> shares(static_cast<std::size_t>(deposit.maxShares()));
  forEachPoint(fine, [&](std::size_t cell, const Vec3f& w) {
    const int count = deposit.shares(w, shares.data());
    for (int i = 0; i < count; ++i) {
      const BinShare& share = shares[static_cast<std::size_t>(i)];
      spread[cell * n + static_cast<std::size_t>(share.bin)] += static_cast<double>(share.weight);
    }
  });
  normaliseColumns(spread, n);
  return spread;
}

}  // namespace photosphere::sphere
