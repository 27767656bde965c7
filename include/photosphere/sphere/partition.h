#pragma once
// Equal-area partition of the sphere into 8 n^2 cells (Min & Ihm 2010, section 4.1.2, figure 4).

#include <cstdint>
#include <vector>

#include "photosphere/core/types.h"

namespace photosphere::sphere {

/// Each octant is divided like a triangle: row i of n (0 at the pole) holds 2 i + 1 cells that
/// share the octant's azimuth evenly. Row i spans z from 1 - (i/n)^2 down to 1 - ((i+1)/n)^2
/// (mirrored below the equator), so that all cells have area 4 pi / (8 n^2). Same bits on every
/// CPU; thread-safe.
class Partition {
 public:
  /// @param rows  1 <= n <= 1024. @throws ConfigError
  explicit Partition(int rows);

  int rows() const { return m_rows; }
  int size() const { return 8 * m_rows * m_rows; }
  float cellArea() const { return static_cast<float>(4.0 * kPi / size()); }
  /// Cell of a unit direction; exact at poles, octant edges and for signed zeros. The zero vector
  /// belongs to cell 0.
  int index(const Vec3f& w) const;
  /// Centre direction of a cell: middle in azimuth, area-middle in z.
  Vec3f center(int cell) const { return point(cell, Vec2d(0.5)); }
  /// Stratified direction inside a cell, u in [0, 1)^2, uniform by area.
  Vec3f point(int cell, const Vec2d& u) const;
  /// Octant (0 to 7: bit 0 set for x < 0, 1 for y < 0, 2 for z < 0).
  int octant(int cell) const { return cell / (m_rows * m_rows); }
  /// The cell of octant 0 that this cell mirrors onto when the octant's axes are flipped. It is
  /// also the cell's position within its octant.
  int mirrored(int cell) const { return cell % (m_rows * m_rows); }
  /// The octant of a direction; zeros of either sign count as positive.
  static int octantOf(const Vec3f& w) {
    return (w.x < 0 ? 1 : 0) + (w.y < 0 ? 2 : 0) + (w.z < 0 ? 4 : 0);
  }

 private:
  int m_rows;
};

}  // namespace photosphere::sphere
