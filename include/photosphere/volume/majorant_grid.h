#pragma once
// Upper bounds of extinction over a coarse lattice: what delta tracking draws against and what
// marching skips empty space by.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "photosphere/core/interrupt.h"
#include "photosphere/core/types.h"
#include "photosphere/volume/bricks.h"

namespace photosphere::volume {

/// One contribution to the extinction: bricks, their placement and what a unit of value is worth.
struct MajorantSource {
  const BrickField<float>* field = nullptr;
  Mat4d localFromNode{1.0};  ///< node position (from the field's origin) to local space [m]
  double scale = 1.0;        ///< extinction per unit of value [1/m]
  double reach = 0.0;        ///< farthest that it moves while the shutter is open [m]
};

/// A region that rays must walk through although nothing in it absorbs or scatters: a flame.
struct WalkedRegion {
  Box3d box;                                                 ///< local space [m]; empty = none
  double spacing = std::numeric_limits<double>::infinity();  ///< of its voxels [m]
};

/// A box with a margin around it [m]; an empty one stays empty.
inline Box3d widened(Box3d box, double margin) {
  if (box.empty()) return box;
  box.min -= margin;
  box.max += margin;
  return box;
}

/// Axis-aligned lattice of majorants of the summed trilinear extinction, local space [m].
class MajorantGrid {
 public:
  MajorantGrid() = default;
  /// Cells are four voxels of the finest source wide, coarsened until at most `maxCells` remain.
  explicit MajorantGrid(std::span<const MajorantSource> sources, const WalkedRegion& also = {},
                        std::size_t maxCells = 1u << 23);

  /// Tight box around all extinction and what is walked beside it, local space [m]; empty when
  /// there is neither.
  const Box3d& bounds() const { return m_bounds; }
  const Vec3i& dims() const { return m_dims; }
  Vec3f cellSize() const { return m_cellSize; }
  float majorant(const Vec3i& cell) const { return m_values[cellIndex(cell)]; }
  /// Number of cells; `Walk::cell` and `forEachOverlapped` count them from 0.
  std::size_t size() const { return m_values.size(); }
  /// Largest majorant [1/m].
  float maximum() const { return m_maximum; }
  /// How many times as wide as the finest source's the voxels of the sources in a cell are, in
  /// whole powers of two: where all are much coarser, steps may be. @param cell  counted from 0
  float coarseness(std::size_t cell) const {
    return m_octaves.empty() ? 1.0f : static_cast<float>(1u << m_octaves[cell]);
  }
  /// Share of the cells that are not empty whose majorant is more than `extinction` [0, 1].
  double shareAbove(float extinction) const;
  /// About how many cubes of that edge fill the cells that are not empty, where smoke is or may
  /// come. @param edge  [m]
  double cubesInside(double edge) const;
  std::uint64_t memoryBytes() const { return m_values.size() * sizeof(float) + m_octaves.size(); }

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
    std::size_t cell() const { return static_cast<std::size_t>(m_index); }
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

  /// Calls visit(cell) for every cell that a cube of node spacings overlaps.
  /// @param lowest, edge  the cube's lowest node and its edge in nodes
  template <class Visit>
  void forEachOverlapped(const Mat4d& localFromNode, const Vec3i& lowest, int edge,
                         const Visit& visit) const {
    const Vec3d x(localFromNode[0]), y(localFromNode[1]), z(localFromNode[2]);
    // Cells that only touch a coarse boundary must not raise the neighbour: the interpolant is
    // continuous, so the shared face is bounded from the inner side up to rounding.
    const double shrink = 1e-4 * std::min({glm::length(x), glm::length(y), glm::length(z)});
    const Vec3d half = 0.5 * edge * (glm::abs(x) + glm::abs(y) + glm::abs(z)) - shrink;
    const Vec3d center = transformPoint(localFromNode, Vec3d(lowest) + 0.5 * edge) - m_bounds.min;
    const Vec3d inverse = 1.0 / Vec3d(m_cellSize);
    const Vec3i lo = glm::max(Vec3i((center - half) * inverse), Vec3i(0));
    const Vec3i hi = glm::min(Vec3i((center + half) * inverse), m_dims - 1);
    for (int k = lo.z; k <= hi.z; ++k)
      for (int j = lo.y; j <= hi.y; ++j)
        for (int i = lo.x; i <= hi.x; ++i)
          visit(cellIndex({i, j, k}));
  }

  /// Raises every cell to the largest value of the cells within a distance [m] of it.
  /// @param cells  one value a cell
  /// @throws InterruptedError
  template <class T>
  void widen(std::vector<T>& cells, double reach) const;

 private:
  std::size_t cellIndex(const Vec3i& c) const {
    return (static_cast<std::size_t>(c.z) * static_cast<std::size_t>(m_dims.y) +
            static_cast<std::size_t>(c.y)) *
               static_cast<std::size_t>(m_dims.x) +
           static_cast<std::size_t>(c.x);
  }
  void splat(const MajorantSource& source, int octaves);

  Box3d m_bounds;
  Vec3f m_origin{0.0f}, m_cellSize{1.0f}, m_inverseCellSize{1.0f};
  Vec3i m_dims{0};
  std::vector<float> m_values;
  std::vector<std::uint8_t> m_octaves;  // of coarseness; none where the voxels of all are alike
  float m_maximum = 0.0f;
};

template <class T>
void MajorantGrid::widen(std::vector<T>& cells, double reach) const {
  if (!(reach > 0)) return;
  for (int axis = 0; axis < 3; ++axis) {
    const int n = m_dims[axis];
    const int r = static_cast<int>(
        std::min<double>(n, std::ceil(reach / static_cast<double>(m_cellSize[axis]))));
    const Vec3i others = axis == 0   ? Vec3i(1, m_dims.y, m_dims.z)
                         : axis == 1 ? Vec3i(m_dims.x, 1, m_dims.z)
                                     : Vec3i(m_dims.x, m_dims.y, 1);
    std::vector<T> row(static_cast<std::size_t>(n));
    for (int z = 0; z < others.z; ++z)
      for (int y = 0; y < others.y; ++y)
        for (int x = 0; x < others.x; ++x) {
          throwIfInterrupted();
          Vec3i c(x, y, z);
          const auto at = [&](int i) -> T& {
            c[axis] = i;
            return cells[cellIndex(c)];
          };
          for (int i = 0; i < n; ++i)
            row[static_cast<std::size_t>(i)] = at(i);
          for (int i = 0; i < n; ++i)
            for (int j = std::max(0, i - r); j <= std::min(n - 1, i + r); ++j)
              at(i) = std::max(at(i), row[static_cast<std::size_t>(j)]);
        }
  }
}

/// Local-space box of the cells of a field where interpolation can give anything but zero [m].
template <class T>
Box3d supportBounds(const BrickField<T>& field, const Mat4d& localFromNode) {
  Box3i nodes;
  forEachCell(field, [&](const Vec3i& cell, int edge, float) {
    nodes.grow(cell);
    nodes.grow(cell + edge);
  });
  if (nodes.empty()) return {};
  return transformBox(localFromNode, {Vec3d(nodes.min), Vec3d(nodes.max)});
}

/// Shortest spacing of nodes along the three axes [m].
inline double finestSpacing(const Mat4d& localFromNode) {
  return std::min({glm::length(Vec3d(localFromNode[0])), glm::length(Vec3d(localFromNode[1])),
                   glm::length(Vec3d(localFromNode[2]))});
}

}  // namespace photosphere::volume
