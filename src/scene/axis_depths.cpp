#include "axis_depths.h"

#include <algorithm>
#include <map>
#include <utility>

#include "photosphere/core/interrupt.h"
#include "photosphere/transport/tracking.h"
#include "photosphere/volume/optical_depth.h"

namespace photosphere::scene {

namespace {

// The parts of rays along one axis that hold smoke. Rays through the same column of majorants share
// them, so that what is empty is passed over once and not by each.
class SmokyParts {
 public:
  // Distances from where a ray enters the bounds [m].
  struct Part {
    float begin, end;
  };

  SmokyParts(const volume::MajorantGrid& cells, int axis) : m_cells(cells), m_axis(axis) {}

  /// @param from  on the face of the bounds that rays enter, local space
  const std::vector<Part>& of(const Vec3f& from) {
    // As a walk rounds it (MajorantGrid::Walk).
    const Vec3f cell = (from - Vec3f(m_cells.bounds().min)) * (1.0f / m_cells.cellSize());
    Vec3i at = glm::clamp(Vec3i(cell), Vec3i(0), m_cells.dims() - 1);
    at[m_axis] = 0;
    const auto [found, isNew] = m_columns.try_emplace({at[(m_axis + 1) % 3], at[(m_axis + 2) % 3]});
    if (isNew) found->second = partsOf(at);
    return found->second;
  }

 private:
  std::vector<Part> partsOf(Vec3i at) const {
    std::vector<Part> parts;
    const double size = static_cast<double>(m_cells.cellSize()[m_axis]);
    const double length = m_cells.bounds().extent()[m_axis];
    bool smoky = false;
    for (int& i = at[m_axis]; i < m_cells.dims()[m_axis]; ++i) {
      const auto end = static_cast<float>(std::min(length, (i + 1) * size));
      const bool follows = std::exchange(smoky, m_cells.majorant(at) > 0.0f);
      if (!smoky) continue;
      if (!follows) parts.push_back({static_cast<float>(i * size), end});
      parts.back().end = end;
    }
    return parts;
  }

  const volume::MajorantGrid& m_cells;
  int m_axis;
  std::map<std::pair<int, int>, std::vector<Part>> m_columns;
};

}  // namespace

std::vector<double> axisDepths(const transport::Medium& medium) {
  constexpr int kRays = 48;
  std::vector<double> depths;
  const Box3d& box = medium.bounds();
  const auto step = static_cast<float>(medium.voxelEdge());
  double largest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    SmokyParts parts(medium.majorants(), axis);
    for (int i = 0; i < kRays * kRays; ++i) {
      throwIfInterrupted();
      Vec3d from = box.min;
      const int a = (axis + 1) % 3, b = (axis + 2) % 3;
      const int column = i % kRays, row = i / kRays;
      from[a] += (column + 0.5) / kRays * box.extent()[a];
      from[b] += (row + 0.5) / kRays * box.extent()[b];
      Vec3f d(0.0f);
      d[axis] = 1.0f;
      double depth = 0;
      for (const SmokyParts::Part& part : parts.of(Vec3f(from)))
        depth += static_cast<double>(transport::marchOpticalDepth(
            medium, Vec3f(from) + d * part.begin, d, part.end - part.begin, step));
      largest = std::max(largest, depth);
      depths.push_back(depth);
    }
  }
  std::sort(depths.begin(), depths.end());
  // A voxel that is out of all measure is not what the smoke is like.
  constexpr double kMeasure = 1e6;
  const auto smoke = std::upper_bound(depths.begin(), depths.end(), 0.0);
  if (smoke != depths.end()) {
    const double usual = *(smoke + (depths.end() - smoke) * 19 / 20);
    if (largest > kMeasure * usual) largest = usual;
  }
  std::erase_if(depths, [&](double d) { return !(d > volume::kTraceDepth * largest); });
  return depths;
}

}  // namespace photosphere::scene
