#include "photosphere/volume/optical_depth.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "openvdb_instances.h"

namespace photosphere::volume {

namespace {

constexpr std::int64_t kMaxColumns = 1 << 20;

/// Sums of density over the voxel columns of one axis.
class Columns {
 public:
  Columns(const Box3i& box, int axis)
      : m_axis(axis), m_u((axis + 1) % 3), m_v((axis + 2) % 3), m_min(box.min) {
    const std::int64_t nu = std::int64_t(box.max[m_u]) - box.min[m_u] + 1;
    const std::int64_t nv = std::int64_t(box.max[m_v]) - box.min[m_v] + 1;
    while (((nu + m_square - 1) / m_square) > kMaxColumns / ((nv + m_square - 1) / m_square))
      m_square *= 2;
    m_width = (nu + m_square - 1) / m_square;
    m_sums.assign(static_cast<std::size_t>(m_width * ((nv + m_square - 1) / m_square)), 0.0);
  }

  /// Adds a box of voxels of one value; it lies inside the grid's box.
  void add(const openvdb::CoordBBox& box, double value) {
    const std::int64_t u0 = box.min()[m_u] - std::int64_t(m_min[m_u]);
    const std::int64_t u1 = box.max()[m_u] - std::int64_t(m_min[m_u]);
    const std::int64_t v0 = box.min()[m_v] - std::int64_t(m_min[m_v]);
    const std::int64_t v1 = box.max()[m_v] - std::int64_t(m_min[m_v]);
    const double length = static_cast<double>(box.max()[m_axis]) - box.min()[m_axis] + 1;
    for (std::int64_t v = v0 / m_square; v <= v1 / m_square; ++v)
      for (std::int64_t u = u0 / m_square; u <= u1 / m_square; ++u)
        m_sums[static_cast<std::size_t>(v * m_width + u)] +=
            value * length * static_cast<double>(covered(u, u0, u1) * covered(v, v0, v1));
  }

  void collect(double voxelEdge, std::vector<double>& depths) const {
    const double factor = voxelEdge / static_cast<double>(m_square * m_square);
    for (const double sum : m_sums)
      if (sum > 0) depths.push_back(sum * factor);
  }

 private:
  /// Columns of square `i` between `first` and `last`.
  std::int64_t covered(std::int64_t i, std::int64_t first, std::int64_t last) const {
    return std::min(last, i * m_square + m_square - 1) - std::max(first, i * m_square) + 1;
  }

  int m_axis, m_u, m_v;
  Vec3i m_min;
  std::int64_t m_square = 1, m_width = 0;
  std::vector<double> m_sums;
};

double percentile(std::vector<double>& values, double fraction) {
  const auto at = values.begin() + std::llround(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

template <class GridType>
std::optional<OpticalDepth> measure(const GridType& grid, const Grid& handle) {
  const Box3i bounds = handle.activeBounds();
  if (bounds.empty()) return std::nullopt;
  Columns columns[3] = {{bounds, 0}, {bounds, 1}, {bounds, 2}};
  double sum = 0, squares = 0;
  for (auto value = grid.cbeginValueOn(); value; ++value) {
    const double density = static_cast<double>(*value);
    if (!std::isfinite(density) || density <= 0) continue;
    const openvdb::CoordBBox box = value.getBoundingBox();
    const double mass = density * static_cast<double>(value.getVoxelCount());
    sum += mass;
    squares += mass * density;
    for (Columns& axis : columns)
      axis.add(box, density);
  }
  const Vec3d edge = handle.voxelSize();
  std::vector<double> depths;
  for (int axis = 0; axis < 3; ++axis)
    columns[axis].collect(edge[axis], depths);
  if (depths.empty()) return std::nullopt;
  const double thickest = *std::max_element(depths.begin(), depths.end());
  std::erase_if(depths, [&](double depth) { return depth < kTraceDepth * thickest; });
  if (!std::isfinite(thickest) || depths.empty()) return std::nullopt;
  OpticalDepth result;
  result.p5 = percentile(depths, 0.05);
  result.median = percentile(depths, 0.5);
  result.p95 = percentile(depths, 0.95);
  result.meanFreePathVoxels = sum / squares / std::cbrt(edge.x * edge.y * edge.z);
  result.suggestedScale = roundedToTwoDigits(kSmokeDepth / result.median);
  return result;
}

}  // namespace

double roundedToTwoDigits(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 1);
  return std::round(value / unit) * unit;
}

std::optional<OpticalDepth> measureOpticalDepth(const Grid& grid) {
  if (!grid || !grid.isAffine()) return std::nullopt;
  if (grid.base()->isType<openvdb::FloatGrid>())
    return measure(static_cast<const openvdb::FloatGrid&>(*grid.base()), grid);
  if (grid.base()->isType<openvdb::DoubleGrid>())
    return measure(static_cast<const openvdb::DoubleGrid&>(*grid.base()), grid);
  return std::nullopt;
}

}  // namespace photosphere::volume
