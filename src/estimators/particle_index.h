#pragma once
// Range queries over particles, and the spatial kernel that weighs what they find.

#include <cstdint>
#include <vector>

#include "photosphere/core/fast_math.h"
#include "photosphere/core/types.h"
#include "photosphere/estimators/light_field.h"

namespace photosphere::estimators {

/// Particles in cubic cells, for range queries. Positions are copied in cell order.
class ParticleIndex {
 public:
  ParticleIndex(const std::vector<Vec3f>& positions, double cellEdge);
  /// Calls visit(particle, squared distance) for every particle within `radius` of p.
  template <class Visit>
  void forEachWithin(const Vec3f& p, float radius, const Visit& visit) const {
    const Vec3i lo = cellOf(p - radius), hi = cellOf(p + radius);
    for (int z = std::max(0, lo.z); z <= std::min(hi.z, m_dims.z - 1); ++z)
      for (int y = std::max(0, lo.y); y <= std::min(hi.y, m_dims.y - 1); ++y)
        for (int x = std::max(0, lo.x); x <= std::min(hi.x, m_dims.x - 1); ++x) {
          const std::size_t cell = index({x, y, z});
          for (std::uint32_t i = m_start[cell]; i < m_start[cell + 1]; ++i) {
            const Vec3f d = m_positions[i] - p;
            const float distance = glm::dot(d, d);
            if (distance <= radius * radius)
              visit(static_cast<std::size_t>(m_original[i]), distance);
          }
        }
  }
  /// The particle nearest to p; ties go to the lowest number.
  std::size_t nearest(const Vec3f& p) const;

 private:
  Vec3i cellOf(const Vec3f& p) const;
  std::size_t index(const Vec3i& c) const {
    return (static_cast<std::size_t>(c.z) * static_cast<std::size_t>(m_dims.y) +
            static_cast<std::size_t>(c.y)) *
               static_cast<std::size_t>(m_dims.x) +
           static_cast<std::size_t>(c.x);
  }
  Vec3f m_min{0.0f};
  float m_inverseEdge = 1.0f;
  float m_edge = 1.0f;
  Vec3i m_dims{0};
  std::vector<std::uint32_t> m_start, m_original;
  std::vector<Vec3f> m_positions;
};

/// Weight of the spatial kernel at a squared distance over the squared radius; zero beyond 1.
inline float kernelWeight(SpatialKernel kernel, float relativeSquared) {
  if (!(relativeSquared <= 1.0f)) return 0.0f;
  switch (kernel) {
    case SpatialKernel::epanechnikov:
      return 1.0f - relativeSquared;
    case SpatialKernel::box:
      return 1.0f;
    case SpatialKernel::gaussian:
      return fastExp(-4.5f * relativeSquared);  // cut at 3 sigma = radius
  }
  return 0.0f;
}

}  // namespace photosphere::estimators
