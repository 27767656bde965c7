#include "particle_index.h"

#include <algorithm>
#include <cmath>

namespace photosphere::estimators {

ParticleIndex::ParticleIndex(const std::vector<Vec3f>& positions, double cellEdge) {
  Box3f box;
  for (const Vec3f& p : positions)
    box.grow(p);
  if (box.empty()) box = {Vec3f(0.0f), Vec3f(0.0f)};
  m_min = box.min;
  // At most about one cell a particle in a full box: a tiny radius must not ask for all memory.
  const Vec3d extent(box.extent());
  double edge = std::max(cellEdge, 1e-30);
  const double limit = 4.0 * static_cast<double>(positions.size()) + 64.0;
  auto cells = [&](int a) { return std::floor(extent[a] / edge) + 1.0; };
  while (cells(0) * cells(1) * cells(2) > limit)
    edge *= 1.5;
  m_edge = static_cast<float>(edge);
  m_inverseEdge = static_cast<float>(1.0 / edge);
  for (int a = 0; a < 3; ++a)
    m_dims[a] = static_cast<int>(cells(a)) + 1;
  m_start.assign(static_cast<std::size_t>(m_dims.x) * static_cast<std::size_t>(m_dims.y) *
                         static_cast<std::size_t>(m_dims.z) +
                     1,
                 0);
  auto clampedCell = [&](const Vec3f& p) { return glm::clamp(cellOf(p), Vec3i(0), m_dims - 1); };
  for (const Vec3f& p : positions)
    ++m_start[index(clampedCell(p)) + 1];
  for (std::size_t i = 1; i < m_start.size(); ++i)
    m_start[i] += m_start[i - 1];
  std::vector<std::uint32_t> next(m_start.begin(), m_start.end() - 1);
  m_original.resize(positions.size());
  m_positions.resize(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const std::uint32_t slot = next[index(clampedCell(positions[i]))]++;
    m_original[slot] = static_cast<std::uint32_t>(i);
    m_positions[slot] = positions[i];
  }
}

Vec3i ParticleIndex::cellOf(const Vec3f& p) const {
  const Vec3f u = glm::clamp((p - m_min) * m_inverseEdge, Vec3f(-1e6f), Vec3f(1e6f));
  return Vec3i(glm::floor(u));
}

std::size_t ParticleIndex::nearest(const Vec3f& p) const {
  std::size_t best = 0;
  float bestDistance = kInfinity;
  const Vec3i c = glm::clamp(cellOf(p), Vec3i(0), m_dims - 1);
  const int rings = std::max(m_dims.x, std::max(m_dims.y, m_dims.z));
  for (int ring = 0; ring <= rings; ++ring) {
    for (int z = std::max(0, c.z - ring); z <= std::min(c.z + ring, m_dims.z - 1); ++z)
      for (int y = std::max(0, c.y - ring); y <= std::min(c.y + ring, m_dims.y - 1); ++y)
        for (int x = std::max(0, c.x - ring); x <= std::min(c.x + ring, m_dims.x - 1); ++x) {
          if (std::max(std::abs(x - c.x), std::max(std::abs(y - c.y), std::abs(z - c.z))) != ring)
            continue;
          const std::size_t cell = index({x, y, z});
          for (std::uint32_t i = m_start[cell]; i < m_start[cell + 1]; ++i) {
            const Vec3f d = m_positions[i] - p;
            const float distance = glm::dot(d, d);
            if (distance < bestDistance || (distance == bestDistance && m_original[i] < best)) {
              bestDistance = distance;
              best = m_original[i];
            }
          }
        }
    // Clamping to the box of cells brings no particle nearer than it is, so whatever lies beyond
    // this ring is at least `ring` cells away.
    const float reach = static_cast<float>(ring) * m_edge;
    if (bestDistance <= reach * reach) break;
  }
  return best;
}

}  // namespace photosphere::estimators
