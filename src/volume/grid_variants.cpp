#include "photosphere/volume/grid_variants.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "openvdb_grid.h"
#include "photosphere/core/error.h"

namespace photosphere::volume {

namespace {

const openvdb::FloatGrid& floats(const Grid& grid) {
  const auto* typed = grid ? dynamic_cast<const openvdb::FloatGrid*>(grid.base().get()) : nullptr;
  if (!typed) throw InputError(grid ? describe(grid) : "grid", "is no grid of floats");
  return *typed;
}

template <class GridT>
Grid converted(const openvdb::FloatGrid& from) {
  using Value = typename GridT::ValueType;
  const auto to = GridT::create();
  auto writer = to->getAccessor();
  for (auto it = from.cbeginValueOn(); it; ++it) {
    openvdb::CoordBBox box;
    it.getBoundingBox(box);
    const float v = *it;
    Value value;
    if constexpr (std::is_same_v<Value, bool>)
      value = v != 0;
    else if constexpr (std::is_integral_v<Value>)
      value = static_cast<Value>(std::llround(v));
    else
      value = static_cast<Value>(v);
    if (it.isVoxelValue())
      writer.setValue(it.getCoord(), value);
    else
      to->fill(box, value);
  }
  to->setTransform(from.transform().copy());
  to->setName(from.getName());
  to->setGridClass(from.getGridClass());
  return Grid(to);
}

}  // namespace

Grid ofType(const Grid& grid, std::string_view type) {
  const openvdb::FloatGrid& from = floats(grid);
  if (type == "float") return grid;
  if (type == "double") return converted<openvdb::DoubleGrid>(from);
  if (type == "int32") return converted<openvdb::Int32Grid>(from);
  if (type == "int64") return converted<openvdb::Int64Grid>(from);
  if (type == "bool") return converted<openvdb::BoolGrid>(from);
  if (type != "half")
    throw InputError(std::string(type),
                     "is no type of grid (known: float, half, double, int32, int64, bool)");
  const openvdb::GridBase::Ptr copy = from.deepCopyGrid();
  copy->setSaveFloatAsHalf(true);
  return Grid(copy);
}

Grid constantGrid(std::string_view name, const Box3i& box, float value,
                  const Mat4d& worldFromIndex) {
  initializeOpenVdb();
  const auto grid = openvdb::FloatGrid::create();
  grid->fill(openvdb::CoordBBox(openvdb::Coord(box.min.x, box.min.y, box.min.z),
                                openvdb::Coord(box.max.x, box.max.y, box.max.z)),
             value);
  grid->setTransform(makeTransform(worldFromIndex));
  grid->setName(std::string(name));
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  return Grid(grid);
}

Grid inFrustum(const Grid& grid) {
  const openvdb::FloatGrid& from = floats(grid);
  const openvdb::CoordBBox box = from.evalActiveVoxelBoundingBox();
  const auto copy = from.deepCopyGrid();
  copy->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(box.min().asVec3d(), box.max().asVec3d()), 2.0, 1.0, 0.1));
  return Grid(copy);
}

}  // namespace photosphere::volume
