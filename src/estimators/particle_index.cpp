#include "particle_index.h"

#include <algorithm>

namespace photosphere::estimators {

ParticleIndex::ParticleIndex(const std::vector<Vec3f>& positions, double cellEdge)
    : m_grid(positions, cellEdge) {
  m_positions.reserve(positions.size());
  for (const std::uint32_t i : m_grid.order())
    m_positions.push_back(positions[i]);
}

std::size_t ParticleIndex::nearest(const Vec3f& p) const {
  std::size_t best = 0;
  float bestDistance = kInfinity;
  const Vec3i dims = m_grid.dimensions();
  const Vec3i c = glm::clamp(m_grid.cellOf(p), Vec3i(0), dims - 1);
  const int rings = std::max(dims.x, std::max(dims.y, dims.z));
  for (int ring = 0; ring <= rings; ++ring) {
    for (int z = std::max(0, c.z - ring); z <= std::min(c.z + ring, dims.z - 1); ++z)
      for (int y = std::max(0, c.y - ring); y <= std::min(c.y + ring, dims.y - 1); ++y)
        for (int x = std::max(0, c.x - ring); x <= std::min(c.x + ring, dims.x - 1); ++x) {
          if (std::max(std::abs(x - c.x), std::max(std::abs(y - c.y), std::abs(z - c.z))) != ring)
            continue;
          const std::uint32_t end = m_grid.cellEnd({x, y, z});
          for (std::uint32_t i = m_grid.cellBegin({x, y, z}); i < end; ++i) {
            const Vec3f d = m_positions[i] - p;
            const float distance = glm::dot(d, d);
            const std::uint32_t particle = m_grid.order()[i];
            if (distance < bestDistance || (distance == bestDistance && particle < best)) {
              bestDistance = distance;
              best = particle;
            }
          }
        }
    // Clamping to the box of cells brings no particle nearer than it is, so whatever lies beyond
    // this ring is at least `ring` cells away.
    const float reach = static_cast<float>(ring) * m_grid.edge();
    if (bestDistance <= reach * reach) break;
  }
  return best;
}

}  // namespace photosphere::estimators
