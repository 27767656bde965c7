#pragma once
// The render-time sampler: a sparse lattice of values in bricks that carry their own apron, so that
// a trilinear lookup reads one brick and never asks a tree.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "photosphere/core/simd.h"
#include "photosphere/core/types.h"
#include "photosphere/volume/grid.h"

namespace photosphere::volume {

/// Sparse lattice of values of type T (float or Vec4f). Node (0,0,0) lies at index `origin()` of
/// the lattice's own index space; positions passed to `sample` count nodes from there. Nodes
/// outside every brick are zero. Immutable after construction; reading is thread-safe.
template <class T>
class BrickField {
 public:
  static constexpr int kEdge = 8;           ///< voxel cells per brick edge
  static constexpr int kNodes = kEdge + 1;  ///< nodes per brick edge, apron included
  static constexpr int kBrickSize = kNodes * kNodes * kNodes;

  BrickField() = default;

  /// Builds from candidate bricks. Empty bricks are dropped and bricks of one constant value share
  /// storage, so tiles are never densified.
  /// @param origin      index of node (0,0,0)
  /// @param bricks      extent in bricks
  /// @param candidates  brick coordinates that may hold anything but zero, each once
  /// @param fetch       fills the 9^3 nodes of a brick, x fastest; called from many threads
  BrickField(const Vec3i& origin, const Vec3i& bricks, const std::vector<Vec3i>& candidates,
             const std::function<void(const Vec3i& brick, T* nodes)>& fetch);

  /// Trilinear value at a position in nodes from the origin; zero outside.
  T sample(const Vec3f& p) const {
    // Written so that NaN fails every test.
    if (!(p.x >= 0.0f && p.y >= 0.0f && p.z >= 0.0f && p.x < m_extent.x && p.y < m_extent.y &&
          p.z < m_extent.z))
      return T(0.0f);
    const int x = static_cast<int>(p.x), y = static_cast<int>(p.y), z = static_cast<int>(p.z);
    const std::int32_t brick = m_table[tableIndex(x >> 3, y >> 3, z >> 3)];
    if (brick < 0) return T(0.0f);
    const T* n = m_nodes.data() + static_cast<std::size_t>(brick) * kBrickSize +
                 ((z & 7) * kNodes + (y & 7)) * kNodes + (x & 7);
    const float fx = p.x - static_cast<float>(x);
    const float fy = p.y - static_cast<float>(y);
    const float fz = p.z - static_cast<float>(z);
    return interpolate(n, fx, fy, fz);
  }

  const Vec3i& origin() const { return m_origin; }
  const Vec3i& bricks() const { return m_bricks; }
  bool empty() const { return m_nodes.empty(); }
  /// Brick storage index at brick coordinates; -1 = all zero.
  std::int32_t brickAt(const Vec3i& b) const { return m_table[tableIndex(b.x, b.y, b.z)]; }
  const T* nodes(std::int32_t brick) const {
    return m_nodes.data() + static_cast<std::size_t>(brick) * kBrickSize;
  }
  bool isConstant(std::int32_t brick) const {
    return m_constant[static_cast<std::size_t>(brick)] != 0;
  }
  std::uint64_t memoryBytes() const {
    return m_table.size() * sizeof(std::int32_t) + m_nodes.size() * sizeof(T) + m_constant.size();
  }

 private:
  // Trilinear value in the cell whose lowest node is n[0].
  static T interpolate(const T* n, float fx, float fy, float fz) {
    constexpr int dy = kNodes, dz = kNodes * kNodes;
    if constexpr (std::is_same_v<T, float>) {
      // Two rows of two nodes a register, below and above.
      const Float4 low = loadPairs(n, n + dy);
      const Float4 face = low + (loadPairs(n + dz, n + dz + dy) - low) * fz;
      const Float4 edge = face + (__builtin_shufflevector(face, face, 2, 3, 2, 3) - face) * fy;
      return edge[0] + (edge[1] - edge[0]) * fx;
    } else {
      const auto at = [n](int i) { return load(&n[i].x); };
      const Float4 c00 = at(0) + (at(1) - at(0)) * fx;
      const Float4 c10 = at(dy) + (at(dy + 1) - at(dy)) * fx;
      const Float4 c01 = at(dz) + (at(dz + 1) - at(dz)) * fx;
      const Float4 c11 = at(dz + dy) + (at(dz + dy + 1) - at(dz + dy)) * fx;
      const Float4 c0 = c00 + (c10 - c00) * fy;
      const Float4 c1 = c01 + (c11 - c01) * fy;
      const Float4 v = c0 + (c1 - c0) * fz;
      return {v[0], v[1], v[2], v[3]};
    }
  }

  std::size_t tableIndex(int bx, int by, int bz) const {
    return (static_cast<std::size_t>(bz) * static_cast<std::size_t>(m_bricks.y) +
            static_cast<std::size_t>(by)) *
               static_cast<std::size_t>(m_bricks.x) +
           static_cast<std::size_t>(bx);
  }

  Vec3i m_origin{0};
  Vec3i m_bricks{0};
  Vec3f m_extent{0.0f};
  std::vector<std::int32_t> m_table;
  std::vector<T> m_nodes;
  std::vector<std::uint8_t> m_constant;
};

/// The way from a place to node positions of a field, in float: what lookups take.
class NodeFromLocal {
 public:
  explicit NodeFromLocal(const Mat4d& localFromNode) {
    const Mat4d inverse = glm::inverse(localFromNode);
    m_x = Vec3f(inverse[0]);
    m_y = Vec3f(inverse[1]);
    m_z = Vec3f(inverse[2]);
    m_offset = Vec3f(inverse[3]);
  }
  Vec3f operator()(const Vec3f& p) const { return direction(p) + m_offset; }
  Vec3f direction(const Vec3f& d) const { return m_x * d.x + m_y * d.y + m_z * d.z; }

 private:
  Vec3f m_x, m_y, m_z, m_offset;
};

extern template class BrickField<float>;
extern template class BrickField<Vec4f>;

/// Calls visit(value) for every stored node; those that bricks share, more than once.
template <class T, class Visit>
void forEachNode(const BrickField<T>& field, const Visit& visit) {
  const Vec3i& bricks = field.bricks();
  for (int z = 0; z < bricks.z && !field.empty(); ++z)
    for (int y = 0; y < bricks.y; ++y)
      for (int x = 0; x < bricks.x; ++x) {
        const std::int32_t brick = field.brickAt({x, y, z});
        for (int i = 0; brick >= 0 && i < BrickField<T>::kBrickSize; ++i)
          visit(field.nodes(brick)[i]);
      }
}

inline float largest(float value) {
  return value;
}
inline float largest(const Vec4f& value) {
  return std::max(std::max(value.x, value.y), std::max(value.z, value.w));
}

/// Calls visit(lowest node, cells along an edge, largest value) for every voxel cell whose
/// interpolant can be positive; a brick of one constant value is visited whole.
template <class T, class Visit>
void forEachCell(const BrickField<T>& field, const Visit& visit) {
  if (field.empty()) return;
  const Vec3i& bricks = field.bricks();
  for (int bz = 0; bz < bricks.z; ++bz)
    for (int by = 0; by < bricks.y; ++by)
      for (int bx = 0; bx < bricks.x; ++bx) {
        const std::int32_t brick = field.brickAt({bx, by, bz});
        if (brick < 0) continue;
        const T* n = field.nodes(brick);
        const Vec3i first(bx * 8, by * 8, bz * 8);
        if (field.isConstant(brick)) {
          visit(first, 8, largest(n[0]));
          continue;
        }
        constexpr int dy = BrickField<T>::kNodes,
                      dz = BrickField<T>::kNodes * BrickField<T>::kNodes;
        for (int z = 0; z < 8; ++z)
          for (int y = 0; y < 8; ++y)
            for (int x = 0; x < 8; ++x) {
              const T* c = n + z * dz + y * dy + x;
              float most = largest(c[0]);
              for (const int corner : {1, dy, dy + 1, dz, dz + 1, dz + dy, dz + dy + 1})
                most = std::max(most, largest(c[corner]));
              if (most > 0) visit(first + Vec3i(x, y, z), 1, most);
            }
      }
}

/// What a grid's values become as they are read.
struct ValueScale {
  double factor = 1.0;
  double most = std::numeric_limits<double>::infinity();  ///< after `factor`; larger ones are cut
  bool checked = false;  ///< findInvalid has found nothing: the values are not looked through again
};

/// A scalar grid, or one component of a vector grid, as bricks. Inactive voxels count as zero.
/// @param component  0 to 2 for a vector grid, 0 for a scalar grid
/// @throws InputError when the grid is neither, or holds a NaN, infinite or (unless allowed)
/// negative
///         value: it names the grid and the first such voxel; MemoryError when the table alone
///         would pass `budgetBytes` (0 = no budget)
BrickField<float> bricksFromGrid(const Grid& grid, int component, const std::string& path,
                                 bool allowNegative, std::uint64_t budgetBytes,
                                 const ValueScale& scale = {});

/// A vec3s grid as bricks of (x, y, z, 0). Inactive voxels count as zero.
/// @throws InputError for another type of grid and for a NaN or infinite value, naming the first
///         such voxel; MemoryError as bricksFromGrid
BrickField<Vec4f> vectorBricksFromGrid(const Grid& grid, const std::string& path,
                                       std::uint64_t budgetBytes);

}  // namespace photosphere::volume
