#include "photosphere/volume/majorant_grid.h"

namespace photosphere::volume {

namespace {

using Field = BrickField<float>;

// Half extents, in local space, of a cube with this many node spacings along its edge.
Vec3d halfExtents(const Mat4d& m, double edge) {
  return 0.5 * edge * (glm::abs(Vec3d(m[0])) + glm::abs(Vec3d(m[1])) + glm::abs(Vec3d(m[2])));
}

double finestSpacing(const Mat4d& m) {
  return std::min({glm::length(Vec3d(m[0])), glm::length(Vec3d(m[1])), glm::length(Vec3d(m[2]))});
}

}  // namespace

Box3d supportBounds(const MajorantSource& source) {
  Box3i nodes;
  forEachCell(*source.field, [&](const Vec3i& cell, int edge, float) {
    nodes.grow(cell);
    nodes.grow(cell + edge);
  });
  Box3d box;
  if (nodes.empty()) return box;
  for (int corner = 0; corner < 8; ++corner)
    box.grow(transformPoint(source.localFromNode, Vec3d(corner & 1 ? nodes.max.x : nodes.min.x,
                                                        corner & 2 ? nodes.max.y : nodes.min.y,
                                                        corner & 4 ? nodes.max.z : nodes.min.z)));
  return box;
}

MajorantGrid::MajorantGrid(std::span<const MajorantSource> sources, std::size_t maxCells) {
  double spacing = std::numeric_limits<double>::infinity();
  for (const MajorantSource& source : sources) {
    if (source.field->empty() || !(source.scale > 0)) continue;
    m_bounds.grow(supportBounds(source));
    spacing = std::min(spacing, finestSpacing(source.localFromNode));
  }
  if (m_bounds.empty()) return;
  const Vec3d extent = m_bounds.extent();
  double cell = 4.0 * spacing;
  auto cellCount = [&](int a) { return std::max(1.0, std::ceil(extent[a] / cell * (1 - 1e-9))); };
  while (cellCount(0) * cellCount(1) * cellCount(2) > static_cast<double>(maxCells))
    cell *= 2;
  for (int a = 0; a < 3; ++a)
    m_dims[a] = static_cast<int>(cellCount(a));
  m_origin = Vec3f(m_bounds.min);
  m_cellSize = Vec3f(static_cast<float>(cell));
  m_inverseCellSize = 1.0f / m_cellSize;
  m_values.assign(static_cast<std::size_t>(m_dims.x) * static_cast<std::size_t>(m_dims.y) *
                      static_cast<std::size_t>(m_dims.z),
                  0.0f);
  for (const MajorantSource& source : sources)
    if (!source.field->empty() && source.scale > 0) splat(source);
  m_maximum = *std::max_element(m_values.begin(), m_values.end());
}

// Raises every coarse cell that a voxel cell of this source overlaps to the sum of what was there
// before this source and the source's own maximum over the cell.
void MajorantGrid::splat(const MajorantSource& source) {
  std::vector<float> own(m_values.size(), 0.0f);
  const Vec3d inverse = 1.0 / Vec3d(m_cellSize);
  // Cells that only touch a coarse boundary must not raise the neighbour: the interpolant is
  // continuous, so the shared face is bounded from the inner side up to rounding.
  const double shrink = 1e-4 * finestSpacing(source.localFromNode);
  forEachCell(*source.field, [&](const Vec3i& cell, int edge, float value) {
    const Vec3d center = transformPoint(source.localFromNode, Vec3d(cell) + 0.5 * edge);
    const Vec3d half = halfExtents(source.localFromNode, edge) - shrink;
    const Vec3i lo = glm::max(Vec3i((center - half - m_bounds.min) * inverse), Vec3i(0));
    const Vec3i hi = glm::min(Vec3i((center + half - m_bounds.min) * inverse), m_dims - 1);
    const float extinction = static_cast<float>(value * source.scale);
    for (int z = lo.z; z <= hi.z; ++z)
      for (int y = lo.y; y <= hi.y; ++y)
        for (int x = lo.x; x <= hi.x; ++x) {
          float& bound = own[cellIndex({x, y, z})];
          bound = std::max(bound, extinction);
        }
  });
  for (std::size_t i = 0; i < own.size(); ++i)
    m_values[i] += own[i];
}

}  // namespace photosphere::volume
