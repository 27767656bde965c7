#include "photosphere/sphere/partition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "directions.h"
#include "photosphere/core/error.h"

namespace photosphere::sphere {

namespace {

// atan(y / x) as part of a quarter turn, for x, y >= 0; 0 for the zero vector. Absolute error below
// 1e-7. Polynomial: Cephes atanf (S. Moshier), public domain.
float quarterTurns(float x, float y) {
  const float large = std::max(x, y), small = std::min(x, y);
  if (!(large > 0)) return 0.0f;
  float t = small / large, offset = 0.0f;
  if (t > 0.414213562f) {  // tan(pi / 8)
    t = (t - 1.0f) / (t + 1.0f);
    offset = 0.5f;
  }
  const float z = t * t;
  float p = 8.05374449538e-2f;
  p = p * z - 1.38776856032e-1f;
  p = p * z + 1.99777106478e-1f;
  p = p * z - 3.33329491539e-1f;
  const float turns = offset + (p * z * t + t) * 0.636619772f;
  return y > x ? 1.0f - turns : turns;
}

}  // namespace

Partition::Partition(int rows) : m_rows(rows) {
  if (rows < 1 || rows > 1024)
    throw ConfigError(fmt::format(
        "rows = {}: a direction histogram has 8 rows^2 bins; use 1 to 1024 rows", rows));
}

int Partition::index(const Vec3f& w) const {
  // 1 - |z| = (x^2 + y^2) / (1 + |z|) for a unit vector: keeps its digits near the pole.
  const float fromPole = (w.x * w.x + w.y * w.y) / (1.0f + std::abs(w.z));
  const int row =
      std::min(m_rows - 1, static_cast<int>(static_cast<float>(m_rows) * std::sqrt(fromPole)));
  const int columns = 2 * row + 1;
  const float turns = quarterTurns(std::abs(w.x), std::abs(w.y));
  const int column = std::min(columns - 1, static_cast<int>(static_cast<float>(columns) * turns));
  return octantOf(w) * m_rows * m_rows + row * row + column;
}

Vec3f Partition::point(int cell, const Vec2d& u) const {
  const int local = mirrored(cell);
  const int row = rowOf(local), columns = 2 * row + 1;
  const double s = std::sqrt(row * row + columns * u.x) / m_rows;
  const double azimuth = (local - row * row + u.y) / columns;
  return Vec3f(mirroredInto(octant(cell), octantDirection(s, azimuth)));
}

}  // namespace photosphere::sphere
