#include "photosphere/volume/grid.h"

#include "openvdb_grid.h"
#include "photosphere/core/error.h"

namespace photosphere::volume {

namespace {

// A mask grid gives its value type as bool, but is no bool grid.
bool isMask(const openvdb::GridBase& grid) {
  return grid.isType<openvdb::MaskGrid>();
}

}  // namespace

std::string Grid::name() const {
  return m_grid ? m_grid->getName() : std::string();
}

std::string Grid::valueType() const {
  if (!m_grid) return {};
  std::string type = isMask(*m_grid) ? "mask" : m_grid->valueType();
  if (m_grid->saveFloatAsHalf()) type.append(" (half)");
  return type;
}

GridKind Grid::kind() const {
  if (!m_grid || isMask(*m_grid)) return GridKind::other;
  const std::string type = m_grid->valueType();
  if (type == "bool" || type == "float" || type == "double" || type == "int32" || type == "int64")
    return GridKind::scalar;
  if (type == "vec3s" || type == "vec3d" || type == "vec3i") return GridKind::vector;
  if (type.starts_with("ptdataidx")) return GridKind::points;
  return GridKind::other;
}

std::uint64_t Grid::activeVoxels() const {
  return m_grid ? m_grid->activeVoxelCount() : 0;
}

Box3i Grid::activeBounds() const {
  Box3i box;
  if (!m_grid || m_grid->empty()) return box;
  openvdb::CoordBBox bounds;
  if (!m_grid->constBaseTree().evalActiveVoxelBoundingBox(bounds)) return box;
  box.grow(fromOpenVdb(bounds.min()));
  box.grow(fromOpenVdb(bounds.max()));
  return box;
}

Box3d Grid::worldBounds() const {
  Box3d world;
  const Box3i index = activeBounds();
  if (index.empty()) return world;
  const Vec3d lo = Vec3d(index.min) - 0.5, hi = Vec3d(index.max) + 0.5;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p(corner & 1 ? hi.x : lo.x, corner & 2 ? hi.y : lo.y, corner & 4 ? hi.z : lo.z);
    world.grow(fromOpenVdb(m_grid->transform().indexToWorld(toOpenVdb(p))));
  }
  return world;
}

bool Grid::isAffine() const {
  return m_grid && m_grid->transform().isLinear();
}

bool Grid::isLevelSet() const {
  return m_grid && m_grid->getGridClass() == openvdb::GRID_LEVEL_SET;
}

Mat4d Grid::worldFromIndex() const {
  if (!isAffine())
    throw InputError(describe(*this),
                     "has a frustum transform, which no matrix describes; resample it to a regular "
                     "grid in the software that wrote it");
  return fromOpenVdb(m_grid->transform().baseMap()->getAffineMap()->getMat4());
}

Vec3d Grid::voxelSize() const {
  return m_grid ? fromOpenVdb(m_grid->transform().voxelSize()) : Vec3d(0);
}

std::map<std::string, std::string> Grid::metadata() const {
  std::map<std::string, std::string> result;
  if (!m_grid) return result;
  for (auto it = m_grid->beginMeta(); it != m_grid->endMeta(); ++it)
    if (it->second) result[it->first] = it->second->str();
  return result;
}

std::uint64_t Grid::memoryBytes() const {
  return m_grid ? m_grid->memUsage() : 0;
}

}  // namespace photosphere::volume
