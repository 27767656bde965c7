#pragma once
// Upper bounds of extinction over a coarse lattice: what delta tracking draws against and what
// marching skips empty space by.

#include <algorithm>
#include <cstddef>
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
        : m_values(grid.m_values.data()), m_t(t0), m_end(t1) {
      const Vec3f p = (o + d * t0 - grid.m_origin) * grid.m_inverseCellSize;
      const Vec3i cell = glm::clamp(Vec3i(p), Vec3i(0), grid.m_dims - 1);
      m_index = static_cast<std::ptrdiff_t>(grid.cellIndex(cell));
      const auto row = static_cast<std::ptrdiff_t>(grid.m_dims.x);
      m_x = Axis(grid, o.x, d.x, t0, cell.x, 0, 1);
      m_y = Axis(grid, o.y, d.y, t0, cell.y, 1, row);
      m_z = Axis(grid, o.z, d.z, t0, cell.z, 2, row * grid.m_dims.y);
    }
    bool done() const { return !(m_t < m_end); }
    float majorant() const { return m_values[m_index]; }
    float begin() const { return m_t; }
    /// End of the current cell along the ray.
    float end() const { return std::min(m_end, std::min(m_x.next, std::min(m_y.next, m_z.next))); }
    void advance() {
      if (m_x.next < m_y.next)
        pass(m_x.next < m_z.next ? m_x : m_z);
      else
        pass(m_y.next < m_z.next ? m_y : m_z);
    }

   private:
    // Crossings of one axis' cell faces.
    struct Axis {
      Axis() = default;
      Axis(const MajorantGrid& grid, float o, float d, float t0, int cell, int axis,
           std::ptrdiff_t toNeighbour) {
        if (d == 0.0f) return;
        const float inverse = 1.0f / d;
        const float size = grid.m_cellSize[axis];
        const bool up = d > 0.0f;
        delta = std::abs(size * inverse);
        next = std::max(
            t0,
            (grid.m_origin[axis] + static_cast<float>(cell + (up ? 1 : 0)) * size - o) * inverse);
        left = up ? grid.m_dims[axis] - 1 - cell : cell;
        stride = up ? toNeighbour : -toNeighbour;
      }
      float next = kInfinity;     // distance of the next face
      float delta = 0.0f;         // between faces
      int left = 0;               // cells beyond this one
      std::ptrdiff_t stride = 0;  // from a cell to the next in memory
    };
    // Written for each axis by itself: a vector indexed at run time would live in memory.
    void pass(Axis& axis) {
      m_t = axis.left-- > 0 ? axis.next : kInfinity;
      axis.next += axis.delta;
      m_index += m_t < kInfinity ? axis.stride : 0;
    }

    const float* m_values;
    float m_t, m_end;
    std::ptrdiff_t m_index = 0;
    Axis m_x, m_y, m_z;
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
