#include "cell_quadrature.h"

#include <algorithm>
#include <cmath>

#include "directions.h"

namespace photosphere::sphere {

namespace {

// A piece is smooth when its radius is below this part of the distance to the lobe's complex pole,
// sqrt(distance^2 + width^2): three Gauss points a side then keep every mean within 0.1 % (see the
// tests).
constexpr float kSmooth = 0.3f;

}  // namespace

CellQuadrature::CellQuadrature(const Partition& partition, double width) : m_width(width) {
  const int rows = partition.rows(), cells = rows * rows;
  const double area = kPi / 2 / cells;
  m_pieces.resize(static_cast<std::size_t>(cells));
  m_points.resize(static_cast<std::size_t>(cells * kPoints));
  for (int cell = 0; cell < cells; ++cell) {
    const int row = rowOf(cell), columns = 2 * row + 1, column = cell - row * row;
    fill(static_cast<std::size_t>(cell),
         {static_cast<double>(row) / rows, static_cast<double>(row + 1) / rows,
          static_cast<double>(column) / columns, static_cast<double>(column + 1) / columns},
         area);
  }
}

bool CellQuadrature::smooth(const Piece& piece, const Vec3f& peak) const {
  const Vec3f d = piece.center - peak;
  const float width = static_cast<float>(m_width);
  return piece.radius * piece.radius <= kSmooth * kSmooth * (glm::dot(d, d) + width * width);
}

void CellQuadrature::fill(std::size_t index, const Range& r, double cellArea) {
  const double sMid = 0.5 * (r.sMin + r.sMax), azimuthMid = 0.5 * (r.azimuthMin + r.azimuthMax);
  const double sSize = r.sMax - r.sMin, azimuthSize = r.azimuthMax - r.azimuthMin;
  const Vec3d center = octantDirection(sMid, azimuthMid);
  double radius = 0;
  for (double s : {r.sMin, r.sMax})
    for (double azimuth : {r.azimuthMin, r.azimuthMax})
      radius = std::max(radius, glm::length(octantDirection(s, azimuth) - center));
  m_pieces[index] = {Vec3f(center), static_cast<float>(radius), 0};

  // Gauss-Legendre, three points on [-1/2, 1/2]. The area element is 2 s ds times the azimuth.
  constexpr double nodes[kOrder] = {-0.38729833462074169, 0.0, 0.38729833462074169};
  constexpr double weights[kOrder] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  for (int i = 0; i < kOrder; ++i)
    for (int j = 0; j < kOrder; ++j) {
      const double s = sMid + sSize * nodes[i];
      const double part =
          weights[i] * weights[j] * 2 * s * sSize * azimuthSize * (kPi / 2) / cellArea;
      m_points[index * kPoints + static_cast<std::size_t>(i * kOrder + j)] = {
          Vec3f(octantDirection(s, azimuthMid + azimuthSize * nodes[j])), static_cast<float>(part)};
    }

  if (radius <= kSmooth * m_width) return;
  // Halve the longer side on the sphere.
  const double across = sMid * std::sqrt(2 - sMid * sMid) * azimuthSize * kPi / 2;
  const double along = 2 * sSize / std::sqrt(2 - sMid * sMid);
  Range a = r, b = r;
  if (across > along)
    a.azimuthMax = b.azimuthMin = azimuthMid;
  else
    a.sMax = b.sMin = sMid;
  const std::size_t child = m_pieces.size();
  m_pieces[index].firstChild = static_cast<int>(child);
  m_pieces.resize(child + 2);
  m_points.resize((child + 2) * kPoints);
  fill(child, a, cellArea);
  fill(child + 1, b, cellArea);
}

double CellQuadrature::mean(int cell, const BinWeights::Phase& phase, const Vec3f& wo,
                            const Vec3f& peak) const {
  return integrate(static_cast<std::size_t>(cell), phase, wo, peak);
}

double CellQuadrature::integrate(std::size_t index, const BinWeights::Phase& phase, const Vec3f& wo,
                                 const Vec3f& peak) const {
  const Piece& piece = m_pieces[index];
  if (piece.firstChild != 0 && !smooth(piece, peak)) {
    const std::size_t child = static_cast<std::size_t>(piece.firstChild);
    return integrate(child, phase, wo, peak) + integrate(child + 1, phase, wo, peak);
  }
  double sum = 0;
  for (std::size_t i = index * kPoints; i < (index + 1) * kPoints; ++i)
    sum += static_cast<double>(m_points[i].weight) * phase(m_points[i].direction, wo);
  return sum;
}

}  // namespace photosphere::sphere
