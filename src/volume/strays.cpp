#include "photosphere/volume/strays.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "openvdb_grid.h"
#include "photosphere/core/error.h"
#include "splats.h"
#include "stray_search.h"

namespace photosphere::volume {

namespace {

Box3d worldBox(const Mat4d& worldFromIndex, const openvdb::CoordBBox& voxels) {
  const Box3d index{Vec3d(fromOpenVdb(voxels.min())) - 0.5, Vec3d(fromOpenVdb(voxels.max())) + 0.5};
  Box3d world;
  for (int corner = 0; corner < 8; ++corner)
    world.grow(transformPoint(worldFromIndex, index.corner(corner)));
  return world;
}

template <class Value>
double weightOf(const Value& value) {
  const auto v = static_cast<double>(value);
  return v > 0 && std::isfinite(v) ? v : 0.0;
}

// Calls onTile(voxels, iterator) for every active tile.
template <class GridT, class OnTile>
void forEachActiveTile(GridT& grid, const OnTile& onTile) {
  auto tile = [&] {
    if constexpr (std::is_const_v<GridT>)
      return grid.cbeginValueOn();
    else
      return grid.beginValueOn();
  }();
  tile.setMaxDepth(std::remove_const_t<GridT>::TreeType::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    openvdb::CoordBBox box;
    tile.getBoundingBox(box);
    onTile(box, tile);
  }
}

// Leaves and tiles, a weight of 1 in all.
template <class GridT>
void addLumps(const GridT& grid, const Mat4d& worldFromIndex, std::vector<Lump>& lumps) {
  const std::size_t begin = lumps.size();
  double all = 0;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    Lump lump;
    lump.count = 0;
    for (auto value = leaf->cbeginValueOn(); value; ++value) {
      const double weight = weightOf(*value);
      lump.weight += weight;
      lump.count += weight > 0;
    }
    if (lump.count == 0) continue;
    lump.box = worldBox(worldFromIndex, leaf->getNodeBoundingBox());
    lump.at = lump.box.center();
    all += lump.weight;
    lumps.push_back(lump);
  }
  forEachActiveTile(grid, [&](const openvdb::CoordBBox& voxels, const auto& tile) {
    const double weight = weightOf(*tile) * static_cast<double>(voxels.volume());
    if (!(weight > 0)) return;
    const Box3d box = worldBox(worldFromIndex, voxels);
    lumps.push_back({box, box.center(), weight, voxels.volume()});
    all += weight;
  });
  for (std::size_t i = begin; i < lumps.size(); ++i)
    lumps[i].weight /= all > 0 ? all : 1.0;
}

// A box so full of leaves has no room for strays, many edges of nothing beside the rest.
bool isFull(const Grid& grid) {
  const Box3i active = grid.activeBounds();
  const auto* base = grid.base().get();
  if (active.empty()) return true;
  const Vec3d size(Vec3d(active.max) - Vec3d(active.min) + 16.0);
  return size.x * size.y * size.z <
         (1 + strays::kReach) * 512.0 * static_cast<double>(base->constBaseTree().leafCount());
}

}  // namespace

std::string Strays::text(std::string_view kind) const {
  return fmt::format(
      "{} of {} {} ({:.2g} % of the smoke) lie{} up to {:.4g} units away from the rest, which is "
      "{:.4g} across",
      count, all, kind, 100 * share, count == 1 ? "s" : "", farthest, size);
}

std::optional<Strays> findStrays(std::span<const Grid> grids) {
  if (std::all_of(grids.begin(), grids.end(),
                  [](const Grid& grid) { return !grid || isFull(grid); }))
    return std::nullopt;
  std::vector<Lump> lumps;
  for (const Grid& grid : grids) {
    if (!grid) continue;
    const Mat4d worldFromIndex = grid.worldFromIndex();
    if (!visitScalarGrid(*grid.base(),
                         [&](const auto& typed) { addLumps(typed, worldFromIndex, lumps); }))
      throw InputError(describe(grid), "has no scalar values");
  }
  return searchStrays(lumps.size(), [&](std::size_t i) { return lumps[i]; });
}

std::optional<Strays> findStrays(const ParticleSet& particles) {
  RasterizeResult ignored;
  return findStrays(collectBlobs(particles, {}, ignored));
}

std::optional<Strays> findStrays(const std::vector<Blob>& blobs) {
  return searchStrays(blobs.size(), [&](std::size_t i) {
    const Blob& blob = blobs[i];
    return Lump{
        {blob.position - blob.radius, blob.position + blob.radius}, blob.position, blob.mass, 1};
  });
}

Grid clipped(const Grid& grid, const Box3d& box) {
  if (!grid) throw InputError("grid", "is missing");
  const Mat4d worldFromIndex = grid.worldFromIndex();
  const auto isOutside = [&](const openvdb::CoordBBox& voxels) {
    return !box.contains(worldBox(worldFromIndex, voxels).center());
  };
  const openvdb::GridBase::Ptr copy = grid.base()->deepCopyGrid();
  const auto clip = [&](auto& typed) {
    for (auto leaf = typed.tree().beginLeaf(); leaf; ++leaf)
      if (isOutside(leaf->getNodeBoundingBox())) leaf->fill(typed.background(), false);
    forEachActiveTile(typed, [&](const openvdb::CoordBBox& voxels, auto& tile) {
      if (!isOutside(voxels)) return;
      tile.setValue(typed.background());
      tile.setActiveState(false);
    });
  };
  if (!visitScalarGrid(*copy, clip) && !visitVectorGrid(*copy, clip))
    throw InputError(describe(grid), "has no scalar or vector values");
  return Grid(copy);
}

}  // namespace photosphere::volume
