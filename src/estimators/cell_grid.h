#pragma once
// Points in cubic cells: range queries that read consecutive slots.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "photosphere/core/types.h"

namespace photosphere::estimators {

/// Which points lie in which cell of a lattice around all of them. Points are numbered by slot,
/// cell by cell, x fastest, in their own order inside a cell: a row of cells is one run of slots.
/// Same grid on every run; immutable; thread-safe.
class CellGrid {
 public:
  CellGrid() = default;
  /// @param edge  wished cell edge [m]; larger where the cells would be many more than the points
  CellGrid(const std::vector<Vec3f>& points, double edge);

  /// The point of each slot.
  const std::vector<std::uint32_t>& order() const { return m_order; }
  float edge() const { return m_edge; }
  const Vec3i& dimensions() const { return m_dims; }
  /// The cell that a position falls in; it may lie outside the grid.
  Vec3i cellOf(const Vec3f& p) const {
    const Vec3f u = glm::clamp((p - m_min) * m_inverseEdge, Vec3f(-1e6f), Vec3f(1e6f));
    return Vec3i(glm::floor(u));
  }
  std::uint32_t cellBegin(const Vec3i& c) const { return m_start[index(c)]; }
  std::uint32_t cellEnd(const Vec3i& c) const { return m_start[index(c) + 1]; }
  std::uint64_t memoryBytes() const {
    return (m_start.size() + m_order.size()) * sizeof(std::uint32_t);
  }
  /// Gives up the table of slots, once the points themselves stand in their order.
  void forgetOrder() { m_order = {}; }

  /// Calls visit(first slot, end slot) for runs that together hold every point within `radius` of
  /// p, and few others: each row of cells is cut to the ball's width there.
  template <class Visit>
  void forEachRun(const Vec3f& p, float radius, const Visit& visit) const {
    // Rounding of positions and cell borders is below a thousandth of a cell (kMostCells).
    const float slack = 1e-3f * m_edge;
    const float reach = radius + slack;
    const Vec3i lo = glm::max(cellOf(p - reach), Vec3i(0));
    const Vec3i hi = glm::min(cellOf(p + reach), m_dims - 1);
    for (int z = lo.z; z <= hi.z; ++z) {
      const float dz = distanceToCell(p.z - m_min.z, z, slack);
      for (int y = lo.y; y <= hi.y; ++y) {
        const float dy = distanceToCell(p.y - m_min.y, y, slack);
        const float left = reach * reach - dz * dz - dy * dy;
        if (left < 0.0f) continue;
        const float half = std::sqrt(left) + slack;
        const int x0 = std::max(lo.x, cellAlong(p.x - half - m_min.x));
        const int x1 = std::min(hi.x, cellAlong(p.x + half - m_min.x));
        if (x0 > x1) continue;
        const std::uint32_t begin = cellBegin({x0, y, z}), end = cellEnd({x1, y, z});
        if (begin < end) visit(begin, end);
      }
    }
  }

  /// Cells along one axis at most: float positions then resolve a thousandth of a cell.
  static constexpr int kMostCells = 2048;

 private:
  int cellAlong(float offset) const {
    return static_cast<int>(std::floor(glm::clamp(offset * m_inverseEdge, -1e6f, 1e6f)));
  }
  // Distance along one axis from an offset to the nearest point of a cell, a little less than true.
  float distanceToCell(float offset, int cell, float slack) const {
    const float low = static_cast<float>(cell) * m_edge;
    return std::max(0.0f, std::max(low - offset, offset - low - m_edge) - slack);
  }
  std::size_t index(const Vec3i& c) const {
    return (static_cast<std::size_t>(c.z) * static_cast<std::size_t>(m_dims.y) +
            static_cast<std::size_t>(c.y)) *
               static_cast<std::size_t>(m_dims.x) +
           static_cast<std::size_t>(c.x);
  }

  Vec3f m_min{0.0f};
  float m_edge = 1.0f, m_inverseEdge = 1.0f;
  Vec3i m_dims{0};
  std::vector<std::uint32_t> m_start, m_order;
};

}  // namespace photosphere::estimators
