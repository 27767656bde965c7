#include "photosphere/volume/grid_variants.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
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

constexpr int kLeastVoxels = 64;  // along the shortest edge, in larger voxels

// How many voxels a larger one spans along an edge; 1 = the grid stays.
template <class GridT>
int largerVoxel(const GridT& grid) {
  if (grid.tree().leafCount() > 0 || grid.empty()) return 1;
  const openvdb::Coord extent = grid.evalActiveVoxelBoundingBox().dim();
  int most = std::min({extent.x(), extent.y(), extent.z()}) / kLeastVoxels;
  for (auto tile = grid.cbeginValueOn(); tile; ++tile) {
    openvdb::CoordBBox box;
    tile.getBoundingBox(box);
    most = std::min(most, box.dim().x());
  }
  return most < 1 ? 1 : static_cast<int>(std::bit_floor(static_cast<unsigned>(most)));
}

template <class GridT>
Grid merged(const GridT& from, int edge, bool cellCentered) {
  const auto to = GridT::create();
  for (auto tile = from.cbeginValueOn(); tile; ++tile) {
    openvdb::CoordBBox box;
    tile.getBoundingBox(box);
    const auto larger = [&](const openvdb::Coord& c) {
      const auto down = [&](int i) { return (i - (i % edge + edge) % edge) / edge; };
      return openvdb::Coord(down(c.x()), down(c.y()), down(c.z()));
    };
    to->fill(openvdb::CoordBBox(larger(box.min()), larger(box.max())), *tile);
  }
  const double first = cellCentered ? 0.0 : 0.5 * (edge - 1);
  const auto transform = from.transform().copy();
  transform->preTranslate(openvdb::Vec3d(first));
  transform->preScale(edge);
  to->setTransform(transform);
  to->setName(from.getName());
  to->setGridClass(from.getGridClass());
  return Grid(to);
}

}  // namespace

Grid tilesInLargerVoxels(const Grid& grid, bool cellCentered) {
  Grid result = grid;
  if (!grid) return result;
  visitScalarGrid(*grid.base(), [&](const auto& typed) {
    if (const int edge = largerVoxel(typed); edge > 1) result = merged(typed, edge, cellCentered);
  });
  return result;
}

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

Grid constantVectorGrid(std::string_view name, const Box3i& box, const Vec3f& value,
                        const Vec3f& background, const Mat4d& worldFromIndex) {
  initializeOpenVdb();
  const auto grid =
      openvdb::Vec3SGrid::create(openvdb::Vec3f(background.x, background.y, background.z));
  grid->denseFill(openvdb::CoordBBox(openvdb::Coord(box.min.x, box.min.y, box.min.z),
                                     openvdb::Coord(box.max.x, box.max.y, box.max.z)),
                  openvdb::Vec3f(value.x, value.y, value.z));
  grid->setTransform(makeTransform(worldFromIndex));
  grid->setName(std::string(name));
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
