#include "cell_grid.h"

namespace photosphere::estimators {

CellGrid::CellGrid(const std::vector<Vec3f>& points, double wishedEdge) {
  Box3f box;
  for (const Vec3f& p : points)
    box.grow(p);
  if (box.empty()) box = {Vec3f(0.0f), Vec3f(0.0f)};
  m_min = box.min;
  // A tiny edge must not ask for all memory: about four cells a point in a full box.
  const Vec3d extent(box.extent());
  double edge = std::max({wishedEdge, 1e-30, maxComponent(extent) / (kMostCells - 2)});
  const double limit = 4.0 * static_cast<double>(points.size()) + 64.0;
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
  auto cellIndex = [&](const Vec3f& p) {
    return index(glm::clamp(cellOf(p), Vec3i(0), m_dims - 1));
  };
  for (const Vec3f& p : points)
    ++m_start[cellIndex(p) + 1];
  for (std::size_t i = 1; i < m_start.size(); ++i)
    m_start[i] += m_start[i - 1];
  std::vector<std::uint32_t> next(m_start.begin(), m_start.end() - 1);
  m_order.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    m_order[next[cellIndex(points[i])]++] = static_cast<std::uint32_t>(i);
}

}  // namespace photosphere::estimators
