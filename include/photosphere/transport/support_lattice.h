#pragma once
// A sparse axis-aligned lattice of cubic voxels over the smoke and a margin around it: where light
// is stored and shadows are tabulated.

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "photosphere/transport/medium.h"

namespace photosphere::transport {

/// Active voxels are those that the medium's extinction can reach, dilated by a margin. They are
/// kept in bricks of 8^3 and numbered consecutively, brick by brick, x fastest inside a brick.
/// Local space.
class SupportLattice {
 public:
  SupportLattice() = default;
  /// @param edge     voxel edge [m]
  /// @param margin   dilation in voxels, >= 0, along each axis
  /// @param keep     whether a voxel about that point is wanted; empty = all are
  /// @throws MemoryError when the brick table alone would pass 4 GiB; InterruptedError
  SupportLattice(const Medium& medium, double edge, int margin,
                 const std::function<bool(const Vec3d&)>& keep = {});
  /// Rebuilds a lattice from its placement and the coordinates of its active voxels, in their
  /// order.
  SupportLattice(const Vec3d& origin, double edge, const Vec3i& bricks,
                 const std::vector<Vec3i>& active);

  double edge() const { return m_edge; }
  /// Lower corner of voxel (0,0,0), local space [m].
  const Vec3d& origin() const { return m_origin; }
  const Vec3i& bricks() const { return m_bricks; }
  std::size_t size() const { return m_voxels.size(); }
  /// Coordinates of the active voxel of that number.
  const Vec3i& voxel(std::size_t number) const { return m_voxels[number]; }
  Vec3f center(std::size_t number) const {
    return Vec3f(m_origin + (Vec3d(m_voxels[number]) + 0.5) * m_edge);
  }
  /// Number of a voxel, or -1 where it is inactive or outside.
  std::int32_t number(const Vec3i& v) const {
    const Vec3i b(v.x >> 3, v.y >> 3, v.z >> 3);
    if (b.x < 0 || b.y < 0 || b.z < 0 || b.x >= m_bricks.x || b.y >= m_bricks.y ||
        b.z >= m_bricks.z)
      return -1;
    const std::int32_t brick = m_table[tableIndex(b)];
    if (brick < 0) return -1;
    return m_numbers[static_cast<std::size_t>(brick) * 512 +
                     static_cast<std::size_t>((v.z & 7) * 64 + (v.y & 7) * 8 + (v.x & 7))];
  }
  /// Coordinates of the bricks that hold an active voxel.
  const std::vector<Vec3i>& activeBricks() const { return m_activeBricks; }
  std::uint64_t memoryBytes() const;

  /// Calls visit(number, distance to entry, length) for every active voxel that a flight crosses,
  /// in order (exact clipping, Amanatides & Woo 1987). `from` in local space, `d` unit, length [m].
  /// Ends whatever the numbers are: a flight that is not finite, or spans more than 2^28 voxels,
  /// crosses none.
  template <class Visit>
  void walk(const Vec3f& from, const Vec3f& d, float length, const Visit& visit) const;

 private:
  std::size_t tableIndex(const Vec3i& b) const {
    return (static_cast<std::size_t>(b.z) * static_cast<std::size_t>(m_bricks.y) +
            static_cast<std::size_t>(b.y)) *
               static_cast<std::size_t>(m_bricks.x) +
           static_cast<std::size_t>(b.x);
  }
  void number();

  Vec3d m_origin{0.0};
  double m_edge = 1.0;
  float m_inverseEdge = 1.0f;
  Vec3f m_originF{0.0f};
  Vec3i m_bricks{0};
  std::vector<std::int32_t> m_table;    // brick number by brick coordinates
  std::vector<std::int32_t> m_numbers;  // 512 voxel numbers a brick
  std::vector<Vec3i> m_activeBricks;
  std::vector<Vec3i> m_voxels;
};

template <class Visit>
void SupportLattice::walk(const Vec3f& from, const Vec3f& d, float length,
                          const Visit& visit) const {
  // Everything in voxel units: u(t) = start + d t, t in voxels. One set of scalars per axis: a
  // vector indexed at run time would live in memory.
  const Vec3f start = (from - m_originF) * m_inverseEdge;
  const float edge = static_cast<float>(m_edge);
  const float end = length * m_inverseEdge;
  // False, too, where one of them is no number.
  const Vec3f reach = glm::abs(start) + glm::abs(d) * end;
  if (!(reach.x + reach.y + reach.z < 0x1p28f)) return;
  struct Axis {
    Axis(float s, float d) : cell(static_cast<int>(std::floor(s))), step(d > 0.0f ? 1 : -1) {
      if (d == 0.0f) return;
      const float inverse = 1.0f / d;
      delta = std::abs(inverse);
      next = glm::max(0.0f, (static_cast<float>(cell + (d > 0.0f ? 1 : 0)) - s) * inverse);
    }
    void pass() {
      next += delta;
      cell += step;
    }
    int cell, step;
    float next = kInfinity, delta = 0.0f;
  };
  Axis x(start.x, d.x), y(start.y, d.y), z(start.z, d.z);
  float t = 0.0f;
  // Faces on the way, and as many for rounding: millions of voxels out, where a float no longer
  // tells them apart, distance alone would not get to the end.
  const auto faces = static_cast<int>((std::abs(d.x) + std::abs(d.y) + std::abs(d.z)) * end);
  for (int left = 2 * faces + 8; t < end && left > 0; --left) {
    const float exit = glm::min(end, glm::min(x.next, glm::min(y.next, z.next)));
    const std::int32_t n = number({x.cell, y.cell, z.cell});
    if (n >= 0 && exit > t) visit(static_cast<std::size_t>(n), t * edge, (exit - t) * edge);
    t = exit;
    if (x.next < y.next)
      x.next < z.next ? x.pass() : z.pass();
    else
      y.next < z.next ? y.pass() : z.pass();
  }
}

}  // namespace photosphere::transport
