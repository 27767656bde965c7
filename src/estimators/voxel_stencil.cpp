#include "voxel_stencil.h"

#include <algorithm>
#include <cstdlib>

namespace photosphere::estimators {

StencilBlock::StencilBlock(const std::vector<Tap>& taps) : m_taps(taps) {
  for (const Tap& tap : taps)
    m_reach =
        std::max({m_reach, std::abs(tap.offset.x), std::abs(tap.offset.y), std::abs(tap.offset.z)});
  m_side = 8 + 2 * m_reach;
  const auto side = static_cast<std::ptrdiff_t>(m_side);
  for (const Tap& tap : taps)
    m_offsets.push_back((tap.offset.z * side + tap.offset.y) * side + tap.offset.x);
  m_numbers.resize(static_cast<std::size_t>(side * side * side));
}

void StencilBlock::place(const transport::SupportLattice& lattice, const Vec3i& brick) {
  const Vec3i corner = brick * 8 - m_reach;
  std::int32_t* number = m_numbers.data();
  for (int z = 0; z < m_side; ++z)
    for (int y = 0; y < m_side; ++y)
      for (int x = 0; x < m_side; ++x)
        *number++ = lattice.number(corner + Vec3i(x, y, z));
  m_active.resize(m_numbers.size());
  for (std::size_t i = 0; i < m_active.size(); ++i)
    m_active[i] = Float4{} + (m_numbers[i] >= 0 ? 1.0f : 0.0f);
}

void StencilBlock::gather(std::size_t slot, const std::vector<Vec4f>& values) {
  std::vector<Float4>& into = m_values[slot];
  into.resize(m_numbers.size());
  for (std::size_t i = 0; i < into.size(); ++i)
    into[i] =
        m_numbers[i] >= 0 ? load(&values[static_cast<std::size_t>(m_numbers[i])].x) : Float4{};
}

}  // namespace photosphere::estimators
