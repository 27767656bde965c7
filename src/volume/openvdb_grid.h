#pragma once
// OpenVDB inside the module: one place that initialises it, translates its types and dispatches on
// a grid's value type.

#include <string>
#include <type_traits>

#include "openvdb_instances.h"
#include "photosphere/volume/grid.h"

namespace photosphere::volume {

/// Registers OpenVDB's types; cheap after the first call. Everything that makes or reads a grid
/// calls it.
void initializeOpenVdb();

inline openvdb::Vec3d toOpenVdb(const Vec3d& v) {
  return {v.x, v.y, v.z};
}
inline Vec3d fromOpenVdb(const openvdb::Vec3d& v) {
  return {v.x(), v.y(), v.z()};
}
inline Vec3i fromOpenVdb(const openvdb::Coord& c) {
  return {c.x(), c.y(), c.z()};
}

/// OpenVDB multiplies row vectors, so its row i is GLM's column i.
openvdb::Mat4d toOpenVdb(const Mat4d& m);
Mat4d fromOpenVdb(const openvdb::Mat4d& m);

/// A transform for an affine matrix.
/// @throws ConfigError when the matrix has no inverse or is not affine
openvdb::math::Transform::Ptr makeTransform(const Mat4d& worldFromIndex);

/// Calls `f` with the grid as its own type when it holds bool, float, double, int32 or int64.
/// @return false when it does not
template <class Base, class F>
bool visitScalarGrid(Base& grid, F&& f) {
  using Types = openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::BoolGrid,
                                  openvdb::Int32Grid, openvdb::Int64Grid>;
  return grid.template apply<Types>(f);
}
/// The same for vectors of floats, doubles or integers.
template <class Base, class F>
bool visitVectorGrid(Base& grid, F&& f) {
  using Types = openvdb::TypeList<openvdb::Vec3SGrid, openvdb::Vec3DGrid, openvdb::Vec3IGrid>;
  return grid.template apply<Types>(f);
}

/// Calls `f(voxels, iterator)` for every active tile; its values may be changed where the grid is
/// not const.
template <class GridT, class F>
void forEachActiveTile(GridT& grid, F&& f) {
  auto tile = [&] {
    if constexpr (std::is_const_v<GridT>)
      return grid.cbeginValueOn();
    else
      return grid.beginValueOn();
  }();
  tile.setMaxDepth(std::remove_const_t<GridT>::TreeType::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    openvdb::CoordBBox voxels;
    tile.getBoundingBox(voxels);
    f(voxels, tile);
  }
}

/// `float grid "density"` for messages.
std::string describe(const Grid& grid);

}  // namespace photosphere::volume
