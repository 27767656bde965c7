#include "reconstruction.h"

#include <cmath>

#include "photosphere/core/parallel.h"

namespace photosphere::sphere {

namespace {

using Matrix = std::vector<double>;

// Gaussian width over the spacing of bin centres: narrower shows the bins, wider needs more
// sharpening.
constexpr double kWidth = 0.6;
constexpr int kSide = 4;  // points along a side of a cell for its mean

// The basis functions: Gaussians about the bins' centres, divided by their sum.
class Basis {
 public:
  explicit Basis(const Partition& bins) {
    for (int bin = 0; bin < bins.size(); ++bin)
      m_centers.emplace_back(bins.center(bin));
  }

  std::size_t size() const { return m_centers.size(); }
  /// Writes their values at a direction.
  void at(const Vec3f& w, double* values) const {
    const double spacing2 = 4 * kPi / static_cast<double>(size());
    double sum = 0;
    for (std::size_t j = 0; j < size(); ++j) {
      const Vec3d d = Vec3d(w) - m_centers[j];
      values[j] = std::exp(-0.5 * glm::dot(d, d) / (kWidth * kWidth * spacing2));
      sum += values[j];
    }
    for (std::size_t j = 0; j < size(); ++j)
      values[j] /= sum;
  }

 private:
  std::vector<Vec3d> m_centers;
};

// Calls visit(direction) for points that stand for equal areas of a cell.
template <class Visit>
void forEachPoint(const Partition& cells, std::size_t cell, const Visit& visit) {
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      visit(cells.point(static_cast<int>(cell), Vec2d(x + 0.5, y + 0.5) / double{kSide}));
}

// Mean of every basis function over every cell, [cell][bin].
Matrix cellMeans(const Basis& basis, const Partition& cells) {
  const std::size_t columns = basis.size();
  Matrix means(static_cast<std::size_t>(cells.size()) * columns, 0.0);
  parallelFor(static_cast<std::size_t>(cells.size()), 8, [&](std::size_t begin, std::size_t end) {
    std::vector<double> values(columns);
    for (std::size_t cell = begin; cell < end; ++cell)
      forEachPoint(cells, cell, [&](const Vec3f& w) {
        basis.at(w, values.data());
        for (std::size_t j = 0; j < columns; ++j)
          means[cell * columns + j] += values[j] / (kSide * kSide);
      });
  });
  return means;
}

// What each bin is given of each basis function's light, [bin][basis], over the area of a bin.
Matrix depositedMeans(const BinShares& deposit, const Basis& basis) {
  const Partition& bins = deposit.partition();
  const std::size_t columns = basis.size();
  Matrix means(columns * columns, 0.0);
  std::vector<double> values(columns);
  std::vector<BinShare> shares(static_cast<std::size_t>(deposit.maxShares()));
  for (std::size_t bin = 0; bin < columns; ++bin)
    forEachPoint(bins, bin, [&](const Vec3f& w) {
      basis.at(w, values.data());
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
  parallelFor(a.size() / n, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      for (std::size_t k = 0; k < n; ++k) {
        const double v = a[i * n + k];
        for (std::size_t j = 0; j < n; ++j)
          c[i * n + j] += v * b[k * n + j];
      }
  });
  return c;
}

}  // namespace

std::vector<double> smoothReconstruction(const BinShares& deposit, const Partition& fine) {
  const Partition& bins = deposit.partition();
  const auto n = static_cast<std::size_t>(bins.size());
  const Basis basis(bins);
  Matrix residual = depositedMeans(deposit, basis);  // I - A
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      residual[i * n + j] = (i == j ? 1.0 : 0.0) - residual[i * n + j];
  // (I + R)(I + R^2) = I + R + R^2 + R^3, the first terms of the inverse of A = I - R.
  Matrix square = multiply(residual, residual, n), once = residual;
  for (std::size_t i = 0; i < n; ++i) {
    square[i * n + i] += 1.0;
    once[i * n + i] += 1.0;
  }
  Matrix spread = multiply(cellMeans(basis, fine), multiply(once, square, n), n);
  normaliseColumns(spread, n);
  return spread;
}

std::vector<double> depositReconstruction(const BinShares& deposit, const Partition& fine) {
  const auto n = static_cast<std::size_t>(deposit.partition().size());
  Matrix spread(static_cast<std::size_t>(fine.size()) * n, 0.0);
  std::vector<BinShare> shares(static_cast<std::size_t>(deposit.maxShares()));
  for (std::size_t cell = 0; cell < static_cast<std::size_t>(fine.size()); ++cell)
    forEachPoint(fine, cell, [&](const Vec3f& w) {
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
