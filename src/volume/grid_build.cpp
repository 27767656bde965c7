// Dense arrays to sparse grids, and grids with another name, place or scale.

#include <fmt/format.h>

#include <algorithm>

#include "openvdb_grid.h"
#include "photosphere/core/error.h"
#include "photosphere/core/parallel.h"
#include "photosphere/volume/vdb_file.h"

namespace photosphere::volume {

namespace {

// Builds the 8^3 leaves of a dense block in parallel and hands them to the tree in order.
// value(i) gives voxel i of the array, x fastest.
template <class GridT, class ValueAt>
typename GridT::Ptr buildFromDense(const Vec3i& dim, const Vec3i& origin,
                                   const typename GridT::ValueType& background,
                                   const ValueAt& valueAt) {
  using Leaf = typename GridT::TreeType::LeafNodeType;
  auto grid = GridT::create(background);
  const Vec3i firstBlock = origin >> 3;
  const Vec3i blocks = ((origin + dim - 1) >> 3) - firstBlock + 1;
  const auto count = static_cast<std::size_t>(blocks.x) * static_cast<std::size_t>(blocks.y) *
                     static_cast<std::size_t>(blocks.z);
  std::vector<std::unique_ptr<Leaf>> leaves(count);
  const auto fill = [&](std::size_t block) {
    const auto bx = static_cast<std::size_t>(blocks.x), by = static_cast<std::size_t>(blocks.y);
    const Vec3i corner = (firstBlock + Vec3i(block % bx, block / bx % by, block / (bx * by))) * 8;
    const Vec3i lo = glm::max(corner, origin), hi = glm::min(corner + 8, origin + dim);
    std::unique_ptr<Leaf>& leaf = leaves[block];
    for (int x = lo.x; x < hi.x; ++x)
      for (int y = lo.y; y < hi.y; ++y)
        for (int z = lo.z; z < hi.z; ++z) {
          const std::size_t at =
              (static_cast<std::size_t>(z - origin.z) * static_cast<std::size_t>(dim.y) +
               static_cast<std::size_t>(y - origin.y)) *
                  static_cast<std::size_t>(dim.x) +
              static_cast<std::size_t>(x - origin.x);
          const auto value = valueAt(at);
          if (value == background) continue;
          if (!leaf)
            leaf = std::make_unique<Leaf>(openvdb::Coord(corner.x, corner.y, corner.z), background,
                                          false);
          leaf->setValueOn(openvdb::Coord(x, y, z), value);
        }
  };
  parallelFor(count, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t block = begin; block < end; ++block)
      fill(block);
  });
  for (std::unique_ptr<Leaf>& leaf : leaves)
    if (leaf) grid->tree().addLeaf(leaf.release());
  return grid;
}

void checkDense(std::string_view name, const Vec3i& dim, std::size_t values,
                std::size_t components) {
  if (dim.x < 0 || dim.y < 0 || dim.z < 0)
    throw ConfigError(
        fmt::format("grid \"{}\" has a negative size {} x {} x {}", name, dim.x, dim.y, dim.z));
  // In double: a product of three 31-bit numbers may leave 64 bits, and one beyond 2^53 is not
  // equal to the size of any vector.
  const double wanted = 1.0 * dim.x * dim.y * dim.z * static_cast<double>(components);
  if (wanted != static_cast<double>(values))
    throw ConfigError(fmt::format("grid \"{}\" of {} x {} x {} voxels was given {} values", name,
                                  dim.x, dim.y, dim.z, values));
}

void setUp(openvdb::GridBase& grid, std::string_view name, const Mat4d& worldFromIndex) {
  grid.setName(std::string(name));
  grid.setTransform(makeTransform(worldFromIndex));
}

// Shares the tree: only name, metadata and transform are the copy's own.
openvdb::GridBase::Ptr shallowCopy(const Grid& grid) {
  if (!grid) throw InputError("grid", "is missing");
  return grid.base()->copyGrid();
}

}  // namespace

Grid denseToGrid(std::string_view name, const Vec3i& dim, const std::vector<float>& values,
                 const Mat4d& worldFromIndex, const Vec3i& origin, float background) {
  checkDense(name, dim, values.size(), 1);
  initializeOpenVdb();
  const auto grid = buildFromDense<openvdb::FloatGrid>(dim, origin, background,
                                                       [&](std::size_t i) { return values[i]; });
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  setUp(*grid, name, worldFromIndex);
  return Grid(grid);
}

Grid denseVectorToGrid(std::string_view name, const Vec3i& dim, const std::vector<float>& values,
                       const Mat4d& worldFromIndex, const Vec3i& origin) {
  checkDense(name, dim, values.size(), 3);
  initializeOpenVdb();
  const auto grid =
      buildFromDense<openvdb::Vec3SGrid>(dim, origin, openvdb::Vec3f(0), [&](std::size_t i) {
        return openvdb::Vec3f(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
      });
  setUp(*grid, name, worldFromIndex);
  return Grid(grid);
}

Grid transformed(const Grid& grid, const Mat4d& worldFromOldWorld) {
  const openvdb::GridBase::Ptr copy = shallowCopy(grid);
  copy->setTransform(makeTransform(worldFromOldWorld * grid.worldFromIndex()));
  return Grid(copy);
}

Grid renamed(const Grid& grid, std::string_view name) {
  const openvdb::GridBase::Ptr copy = shallowCopy(grid);
  copy->setName(std::string(name));
  return Grid(copy);
}

Grid scaled(const Grid& grid, double factor) {
  if (!grid) throw InputError("grid", "is missing");
  const openvdb::GridBase::Ptr copy = grid.base()->deepCopyGrid();
  const auto scale = [factor]<class GridT>(GridT& typed) {
    using Value = typename GridT::ValueType;
    using Element = typename openvdb::VecTraits<Value>::ElementType;
    for (auto it = typed.beginValueAll(); it; ++it) {
      const Value old = *it;
      it.setValue(Value(static_cast<Element>(old[0] * factor),
                        static_cast<Element>(old[1] * factor),
                        static_cast<Element>(old[2] * factor)));
    }
  };
  using Types = openvdb::TypeList<openvdb::Vec3SGrid, openvdb::Vec3DGrid, openvdb::Vec3IGrid>;
  if (!copy->apply<Types>(scale)) throw InputError(describe(grid), "is not a vector grid");
  return Grid(copy);
}

}  // namespace photosphere::volume
