#pragma once
// Weighted sums over the neighbours of every voxel of a lattice, brick by brick.

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "photosphere/core/parallel.h"
#include "photosphere/core/simd.h"
#include "photosphere/transport/support_lattice.h"

namespace photosphere::estimators {

/// Weight of the neighbour at an offset.
struct Tap {
  Vec3i offset;
  float weight;
};

/// Values of the voxels of a brick and of those in reach of its taps, x fastest.
class StencilBlock {
 public:
  /// Voxels side by side along x that are summed at a time.
  static constexpr int kRow = 4;
  using Row = std::array<Float4, kRow>;

  /// @param taps  kept by reference
  explicit StencilBlock(const std::vector<Tap>& taps);

  void place(const transport::SupportLattice& lattice, const Vec3i& brick);
  /// Values of the voxels that are active; 0 of the others.
  /// @param slot  0 or 1
  void gather(std::size_t slot, const std::vector<Vec4f>& values);
  const Float4* values(std::size_t slot) const { return m_values[slot].data(); }
  /// 1 in every lane where a voxel is active, and 0.
  const Float4* active() const { return m_active.data(); }

  /// Calls tap(weight, offset) for every tap: to voxels of a block.
  template <class Visit>
  void forEachTap(const Visit& visit) const {
    for (std::size_t t = 0; t < m_offsets.size(); ++t)
      visit(m_taps[t].weight, m_offsets[t]);
  }
  /// Calls row(voxel of the block, numbers) for rows with an active voxel.
  template <class Visit>
  void forEachRow(const Visit& visit) const {
    for (int z = 0; z < 8; ++z)
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; x += kRow) {
          const std::size_t first = static_cast<std::size_t>(
              ((z + m_reach) * m_side + y + m_reach) * m_side + x + m_reach);
          const std::int32_t* numbers = m_numbers.data() + first;
          if (std::any_of(numbers, numbers + kRow, [](std::int32_t n) { return n >= 0; }))
            visit(first, numbers);
        }
  }

 private:
  const std::vector<Tap>& m_taps;
  int m_reach = 0, m_side = 8;
  std::vector<std::ptrdiff_t> m_offsets;  // of taps
  std::vector<std::int32_t> m_numbers;
  std::array<std::vector<Float4>, 2> m_values;
  std::vector<Float4> m_active;
};

/// Calls body(block) for every brick that holds an active voxel, placed there, on all threads.
template <class Body>
void forEachBrick(const transport::SupportLattice& lattice, const std::vector<Tap>& taps,
                  const Body& body) {
  const std::vector<Vec3i>& bricks = lattice.activeBricks();
  parallelFor(bricks.size(), 4, [&](std::size_t begin, std::size_t end) {
    StencilBlock block(taps);
    for (std::size_t b = begin; b < end; ++b) {
      block.place(lattice, bricks[b]);
      body(block);
    }
  });
}

}  // namespace photosphere::estimators
