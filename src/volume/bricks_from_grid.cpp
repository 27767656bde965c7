#include <fmt/format.h>

#include <set>

#include "openvdb_grid.h"
#include "photosphere/core/error.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/resources.h"
#include "photosphere/volume/bricks.h"
#include "photosphere/volume/invalid_values.h"

namespace photosphere::volume {

namespace {

using Field = BrickField<float>;

struct CoordLess {
  bool operator()(const Vec3i& a, const Vec3i& b) const {
    if (a.z != b.z) return a.z < b.z;
    return a.y != b.y ? a.y < b.y : a.x < b.x;
  }
};

template <class ValueT>
double componentOf(const ValueT& value, int c) {
  if constexpr (openvdb::VecTraits<ValueT>::IsVec)
    return static_cast<double>(value[c]);
  else
    return static_cast<double>(value);
}

void checkValues(const Grid& grid, const std::string& path, bool allowNegative) {
  const InvalidValues found = findInvalid(grid, !allowNegative);
  if (found.total() == 0) return;
  throw InputError(path, fmt::format("grid '{}' holds {} at voxel ({}, {}, {}); clean the cache "
                                     "(`photosphere inspect` counts such voxels)",
                                     grid.name(), found.firstValue, found.first.x, found.first.y,
                                     found.first.z));
}

// The bricks that a box of nodes touches: node i belongs to cells i-1 and i.
void touch(std::set<Vec3i, CoordLess>& bricks, const openvdb::CoordBBox& box, const Vec3i& origin) {
  const Vec3i lo(box.min().x() - origin.x, box.min().y() - origin.y, box.min().z() - origin.z);
  const Vec3i hi(box.max().x() - origin.x, box.max().y() - origin.y, box.max().z() - origin.z);
  for (int z = (lo.z - 1) >> 3; z <= hi.z >> 3; ++z)
    for (int y = (lo.y - 1) >> 3; y <= hi.y >> 3; ++y) {
      throwIfInterrupted();
      for (int x = (lo.x - 1) >> 3; x <= hi.x >> 3; ++x)
        bricks.insert({x, y, z});
    }
}

// The nodes of a grid as values of type T; read(value) makes one of an active voxel.
template <class T, class GridT, class Read>
BrickField<T> build(const GridT& grid, const std::string& path, std::uint64_t budgetBytes,
                    const Read& read) {
  const openvdb::CoordBBox active = grid.evalActiveVoxelBoundingBox();
  if (active.empty() || grid.activeVoxelCount() == 0) return {};
  const Vec3i lo(active.min().x(), active.min().y(), active.min().z());
  const Vec3i origin = lo - 1;  // one zero node beyond the active box, where the smoke fades out
  // Nodes lo-1 .. max+1 make max - lo + 2 cells.
  const auto cells = [](int from, int to) { return static_cast<std::int64_t>(to) - from + 2; };
  const std::int64_t nx = (cells(lo.x, active.max().x()) + 7) / 8;
  const std::int64_t ny = (cells(lo.y, active.max().y()) + 7) / 8;
  const std::int64_t nz = (cells(lo.z, active.max().z()) + 7) / 8;
  const double tableBytes =
      4.0 * static_cast<double>(nx) * static_cast<double>(ny) * static_cast<double>(nz);
  const double limit = budgetBytes ? static_cast<double>(budgetBytes) : 1.6e10;
  if (tableBytes > limit)
    throw MemoryError(
        fmt::format("{}: grid '{}' spans {} x {} x {} voxels; its brick table alone needs {} of "
                    "the {} that are "
                    "free. Remove stray voxels far from the smoke or raise render.memory_limit",
                    path, grid.getName(), nx * 8, ny * 8, nz * 8,
                    formatBytes(static_cast<std::uint64_t>(tableBytes)),
                    formatBytes(static_cast<std::uint64_t>(limit))));

  std::set<Vec3i, CoordLess> touched;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
    if (!leaf->isEmpty()) touch(touched, leaf->getNodeBoundingBox(), origin);
  forEachActiveTile(
      grid, [&](const openvdb::CoordBBox& voxels, const auto&) { touch(touched, voxels, origin); });
  std::vector<Vec3i> candidates;
  for (const Vec3i& b : touched)
    if (b.x >= 0 && b.y >= 0 && b.z >= 0 && b.x < nx && b.y < ny && b.z < nz)
      candidates.push_back(b);

  auto fetch = [&](const Vec3i& b, T* nodes) {
    const auto accessor = grid.getConstUnsafeAccessor();
    const openvdb::Coord first(origin.x + b.x * 8, origin.y + b.y * 8, origin.z + b.z * 8);
    typename GridT::ValueType value;
    for (int z = 0; z < Field::kNodes; ++z)
      for (int y = 0; y < Field::kNodes; ++y)
        for (int x = 0; x < Field::kNodes; ++x) {
          const bool on = accessor.probeValue(first.offsetBy(x, y, z), value);
          *nodes++ = on ? read(value) : T(0.0f);
        }
  };
  return BrickField<T>(origin,
                       Vec3i(static_cast<int>(nx), static_cast<int>(ny), static_cast<int>(nz)),
                       candidates, fetch);
}

using Supported = openvdb::TypeList<openvdb::BoolGrid, openvdb::FloatGrid, openvdb::DoubleGrid,
                                    openvdb::Int32Grid, openvdb::Int64Grid, openvdb::Vec3SGrid,
                                    openvdb::Vec3DGrid, openvdb::Vec3IGrid>;

}  // namespace

Field bricksFromGrid(const Grid& grid, int component, const std::string& path, bool allowNegative,
                     std::uint64_t budgetBytes, const ValueScale& scale) {
  Field field;
  const bool known = grid.base()->apply<Supported>([&](const auto& typed) {
    if (!scale.checked) checkValues(grid, path, allowNegative);
    field = build<float>(typed, path, budgetBytes, [&](const auto& value) {
      return static_cast<float>(std::min(componentOf(value, component) * scale.factor, scale.most));
    });
  });
  if (!known)
    throw InputError(path,
                     fmt::format("grid '{}' is of type {}, which cannot be a coefficient; use a "
                                 "float, half, double, int, bool or vec3 grid",
                                 grid.name(), grid.valueType()));
  return field;
}

BrickField<Vec4f> vectorBricksFromGrid(const Grid& grid, const std::string& path,
                                       std::uint64_t budgetBytes) {
  BrickField<Vec4f> field;
  const bool known =
      grid.base()->apply<openvdb::TypeList<openvdb::Vec3SGrid>>([&](const auto& typed) {
        checkValues(grid, path, true);
        field = build<Vec4f>(typed, path, budgetBytes, [](const openvdb::Vec3f& v) {
          return Vec4f(v.x(), v.y(), v.z(), 0.0f);
        });
      });
  if (!known)
    throw InputError(
        path, fmt::format("grid '{}' is of type {}, not vec3s", grid.name(), grid.valueType()));
  return field;
}

}  // namespace photosphere::volume
