#pragma once
// Range queries over particles, and the spatial kernel that weighs what they find.

#include <cstdint>
#include <vector>

#include "cell_grid.h"
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
    m_grid.forEachRun(p, radius, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) {
        const Vec3f d = m_positions[i] - p;
        const float distance = glm::dot(d, d);
        if (distance <= radius * radius)
          visit(static_cast<std::size_t>(m_grid.order()[i]), distance);
      }
    });
  }
  /// The particle nearest to p; ties go to the lowest number.
  std::size_t nearest(const Vec3f& p) const;

 private:
  CellGrid m_grid;
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
