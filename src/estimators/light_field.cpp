#include "photosphere/estimators/light_field.h"

#include <algorithm>
#include <cmath>

#include "photosphere/estimators/light_sums.h"

namespace photosphere::estimators {

using transport::Medium;

namespace {

// Crossings in the ball of the automatic radius. Set on a sphere, a fractal plume and the shipped
// column, 2026-11-22: half of it is noisier, twice as much is darker at the smoke's edge.
constexpr double kWantedCrossings = 2000.0;

}  // namespace

double automaticRadius(const Medium& medium, const LightFieldLayout& layout,
                       std::uint64_t photons) {
  if (medium.bounds().empty()) return 0.0;
  const double edge = layout.lightVoxel * medium.voxelEdge();
  const Vec3d cells = glm::max(medium.bounds().extent() / edge, Vec3d(1.0));
  const double voxels = cells.x * cells.y * cells.z;
  // Crossings of one voxel if photons filled the box evenly, each crossing it about twice.
  const double crossings =
      std::max(1e-6, 2.0 * static_cast<double>(std::max<std::uint64_t>(1, photons)) *
                         std::cbrt(voxels) / voxels);
  const double radius = edge * std::cbrt(kWantedCrossings / (crossings * 4.0 / 3.0 * kPi));
  // Less than a voxel smooths nothing; beyond four the picture is mush whatever the noise.
  return std::clamp(radius, 0.5 * edge, 4.0 * edge);
}

LightField traceLightField(const Medium& medium, const transport::LightList& lights,
                           const LightFieldLayout& layout, const View& view,
                           const std::vector<Vec3f>& particles,
                           const transport::TraceOptions& options,
                           transport::TraceStatistics& statistics) {
  return toField(traceLightSums(medium, lights, layout, view, particles, options, statistics));
}

}  // namespace photosphere::estimators
