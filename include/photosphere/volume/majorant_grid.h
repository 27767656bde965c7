#pragma once
// Upper bounds of extinction over a coarse lattice: what delta tracking draws against and what
// marching skips empty space by.

#include <span>
#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/volume/bricks.h"

namespace photosphere::volume {

/// One contribution to the extinction: bricks, their placement and what a unit of value is worth.
struct MajorantSource {
  const BrickField<float>* field = nullptr;
  Mat4d localFromNode{1.0};  ///< node position (from the field's origin) to local space [m]
  double scale = 1.0;        ///< extinction per unit of value [1/m]
};

/// Axis-aligned lattice of majorants of the summed trilinear extinction, local space [m].
class MajorantGrid {
 public:
  MajorantGrid() = default;
  /// Cells are four voxels of the finest source wide, coarsened until at most `maxCells` remain.
  explicit MajorantGrid(std::span<const MajorantSource> sources, std::size_t maxCells = 1u << 23);

  /// Tight box around all extinction, local space [m]; empty when there is none.
  const Box3d& bounds() const { return m_bounds; }
  const Vec3i& dims() const { return m_dims; }
  Vec3f cellSize() const { return m_cellSize; }
  float majorant(const Vec3i& cell) const { return m_values[cellIndex(cell)]; }
  /// Largest majorant [1/m].
  float maximum() const { return m_maximum; }
  std::uint64_t memoryBytes() const { return m_values.size() * sizeof(float); }

  /// Walks the cells along a ray in order.
  class Walk {
   public:
    /// @param o, d        local space; d unit
    /// @param t0, t1      part of the ray to walk, inside the bounds
    Walk(const MajorantGrid& grid, const Vec3f& o, const Vec3f& d, float t0, float t1)
        : m_grid(&grid), m_t(t0), m_end(t1) {
      const Vec3f p = (o + d * t0 - grid.m_origin) * grid.m_inverseCellSize;
      for (int a = 0; a < 3; ++a) {
        int cell = static_cast<int>(p[a]);
        cell = std::clamp(cell, 0, grid.m_dims[a] - 1);
        m_cell[a] = cell;
        const float inverse = 1.0f / d[a];
        m_step[a] = d[a] > 0 ? 1 : -1;
        m_delta[a] = d[a] != 0 ? std::abs(grid.m_cellSize[a] * inverse) : kInfinity;
        const float plane =
            grid.m_origin[a] + static_cast<float>(cell + (d[a] > 0 ? 1 : 0)) * grid.m_cellSize[a];
        m_next[a] = d[a] != 0 ? std::max(t0, (plane - o[a]) * inverse) : kInfinity;
      }
      m_index = grid.cellIndex(m_cell);
    }
    bool done() const { return !(m_t < m_end); }
    float majorant() const { return m_grid->m_values[m_index]; }
    float begin() const { return m_t; }
    /// End of the current cell along the ray.
    float end() const { return std::min(m_end, std::min(m_next.x, std::min(m_next.y, m_next.z))); }
    void advance() {
      const int a =
          m_next.x < m_next.y ? (m_next.x < m_next.z ? 0 : 2) : (m_next.y < m_next.z ? 1 : 2);
      m_t = m_next[a];
      m_cell[a] += m_step[a];
      if (m_cell[a] < 0 || m_cell[a] >= m_grid->m_dims[a]) {
        m_t = m_end;
        return;
      }
      m_next[a] += m_delta[a];
      m_index = m_grid->cellIndex(m_cell);
    }

   private:
    const MajorantGrid* m_grid;
    float m_t, m_end;
    Vec3i m_cell{0}, m_step{0};
    Vec3f m_next{0.0f}, m_delta{0.0f};
    std::size_t m_index = 0;
  };

 private:
  std::size_t cellIndex(const Vec3i& c) const {
    return (static_cast<std::size_t>(c.z) * static_cast<std::size_t>(m_dims.y) +
            static_cast<std::size_t>(c.y)) *
               static_cast<std::size_t>(m_dims.x) +
           static_cast<std::size_t>(c.x);
  }
  void splat(const MajorantSource& source);

  Box3d m_bounds;
  Vec3f m_origin{0.0f}, m_cellSize{1.0f}, m_inverseCellSize{1.0f};
  Vec3i m_dims{0};
  std::vector<float> m_values;
  float m_maximum = 0.0f;
};

/// Local-space box of the cells of a field where interpolation can give anything but zero [m].
Box3d supportBounds(const MajorantSource& source);

}  // namespace photosphere::volume
