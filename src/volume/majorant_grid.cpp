#include "photosphere/volume/majorant_grid.h"

#include <cmath>

namespace photosphere::volume {

MajorantGrid::MajorantGrid(std::span<const MajorantSource> sources, const WalkedRegion& also,
                           std::size_t maxCells) {
  double spacing = std::numeric_limits<double>::infinity();
  if (!also.box.empty()) {
    m_bounds = also.box;
    spacing = also.spacing;
  }
  for (const MajorantSource& source : sources) {
    if (source.field->empty() || !(source.scale > 0)) continue;
    m_bounds.grow(widened(supportBounds(*source.field, source.localFromNode), source.reach));
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
  const auto holds = [](const MajorantSource& source) {
    return !source.field->empty() && source.scale > 0;
  };
  // Of what extinguishes: a flame's voxels may be finer.
  double finest = std::numeric_limits<double>::infinity();
  for (const MajorantSource& source : sources)
    if (holds(source)) finest = std::min(finest, finestSpacing(source.localFromNode));
  const auto octavesOf = [&](const MajorantSource& source) {
    const double times = finestSpacing(source.localFromNode) / finest;
    return static_cast<int>(std::clamp(std::floor(std::log2(times * (1 + 1e-6))), 0.0, 30.0));
  };
  if (std::any_of(sources.begin(), sources.end(), [&](const MajorantSource& source) {
        return holds(source) && octavesOf(source) > 0;
      }))
    m_octaves.assign(m_values.size(), 30);
  for (const MajorantSource& source : sources)
    if (holds(source)) splat(source, octavesOf(source));
  m_maximum = *std::max_element(m_values.begin(), m_values.end());
}

double MajorantGrid::shareAbove(float extinction) const {
  std::size_t smoke = 0, above = 0;
  for (const float majorant : m_values) {
    smoke += majorant > 0.0f;
    above += majorant > extinction;
  }
  return smoke ? static_cast<double>(above) / static_cast<double>(smoke) : 0.0;
}

double MajorantGrid::cubesInside(double edge) const {
  const auto filled = std::count_if(m_values.begin(), m_values.end(),
                                    [](float majorant) { return majorant > 0.0f; });
  const Vec3d size = Vec3d(m_cellSize) / edge;
  return static_cast<double>(filled) * size.x * size.y * size.z;
}

// Raises every coarse cell that a voxel cell of this source overlaps to the sum of what was there
// before this source and the source's own maximum over the cell.
void MajorantGrid::splat(const MajorantSource& source, int octaves) {
  std::vector<float> own(m_values.size(), 0.0f);
  forEachCell(*source.field, [&](const Vec3i& cell, int edge, float value) {
    const float extinction = static_cast<float>(value * source.scale);
    forEachOverlapped(source.localFromNode, cell, edge,
                      [&](std::size_t coarse) { own[coarse] = std::max(own[coarse], extinction); });
  });
  widen(own, source.reach);
  for (std::size_t i = 0; i < own.size(); ++i) {
    m_values[i] += own[i];
    if (!m_octaves.empty() && own[i] > 0.0f)
      m_octaves[i] = std::min(m_octaves[i], static_cast<std::uint8_t>(octaves));
  }
}

}  // namespace photosphere::volume
