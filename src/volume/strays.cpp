#include "photosphere/volume/strays.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "openvdb_grid.h"
#include "photosphere/core/error.h"
#include "photosphere/core/interrupt.h"
#include "splats.h"

namespace photosphere::volume {

namespace {

// A particle with its radius, or a block of voxels.
struct Lump {
  Box3d box;
  Vec3d at;           // where it counts as being: inside the box
  double weight = 0;  // finite, not negative
  std::uint64_t count = 1;
};

constexpr double kMostShare = 0.005, kMostCount = 0.01;
// Distance from the rest, in longest edges of its box.
constexpr double kReach = 64;

// Weights along one axis of a box, and what lies below and above it.
class Profile {
 public:
  Profile(double low, double high)
      : m_low(low), m_high(high), m_scale(kBins / (high - low)), m_bins(kBins) {}
  void add(double at, double weight) {
    const double bin = (at - m_low) * m_scale;
    if (bin < 0)
      m_below += weight;
    else if (bin > kBins)
      m_above += weight;
    else
      m_bins[std::min(static_cast<std::size_t>(bin), kBins - 1)] += weight;
  }
  // Bounds of what remains when no more than `most` is left out at either end, wider by a bin
  // against rounding.
  std::pair<double, double> within(double most) const {
    std::size_t first = 0, last = kBins;
    for (double sum = m_below; first + 1 < kBins && (sum += m_bins[first]) <= most; ++first) {
    }
    for (double sum = m_above; last > first + 1 && (sum += m_bins[last - 1]) <= most; --last) {
    }
    const auto at = [&](std::size_t bin) { return m_low + static_cast<double>(bin) / m_scale; };
    return {first > 1 ? at(first - 1) : m_low, last + 1 < kBins ? at(last + 1) : m_high};
  }

 private:
  static constexpr std::size_t kBins = 1024;
  double m_low, m_high, m_scale;
  double m_below = 0, m_above = 0;
  std::vector<double> m_bins;
};

// Closes in on nearly all of the weight, some hundred times a round at most.
// @param whole  around all pieces
// @param all    weight of all
template <class LumpAt>
Box3d middleOf(std::size_t count, const LumpAt& lump, const Box3d& whole, double all) {
  Box3d middle = whole;
  for (bool closer = true; closer;) {
    throwIfInterrupted();
    const Box3d before = middle;
    closer = false;
    for (int axis = 0; axis < 3; ++axis) {
      const double edge = before.extent()[axis];
      if (!(edge > 0)) continue;
      Profile profile(before.min[axis], before.max[axis]);
      for (std::size_t i = 0; i < count; ++i) {
        const Lump piece = lump(i);
        profile.add(piece.at[axis], piece.weight);
      }
      const auto [low, high] = profile.within(kMostShare * all);
      middle.min[axis] = low;
      middle.max[axis] = high;
      closer = closer || (high - low < 0.5 * edge && high - low > 1e-12 * whole.extent()[axis]);
    }
  }
  return middle;
}

// @param lump  gives piece i of `count`; called several times for each
template <class LumpAt>
std::optional<Strays> searchStrays(std::size_t count, const LumpAt& lump) {
  Box3d whole;
  Strays found;
  double all = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Lump piece = lump(i);
    whole.grow(piece.at);
    all += piece.weight;
    found.all += piece.count;
  }
  if (!(all > 0) || !std::isfinite(all) || !std::isfinite(maxComponent(whole.extent())))
    return std::nullopt;
  const Box3d middle = middleOf(count, lump, whole, all);
  Box3d rest;
  for (std::size_t i = 0; i < count; ++i)
    if (const Lump piece = lump(i); middle.contains(piece.at)) rest.grow(piece.box);
  if (rest.empty()) return std::nullopt;
  found.size = maxComponent(rest.extent());
  found.kept = {glm::max(rest.min - kReach * found.size, glm::min(whole.min, rest.min)),
                glm::min(rest.max + kReach * found.size, glm::max(whole.max, rest.max))};
  const Box3d near = found.kept;
  double outside = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Lump piece = lump(i);
    if (near.contains(piece.at)) {
      found.kept.grow(piece.box);
      continue;
    }
    outside += piece.weight;
    found.count += piece.count;
    found.farthest = std::max(found.farthest, glm::length(piece.at - rest.nearest(piece.at)));
  }
  found.share = outside / all;
  if (found.count == 0 || found.share > kMostShare ||
      static_cast<double>(found.count) > kMostCount * static_cast<double>(found.all))
    return std::nullopt;
  return found;
}

Box3d worldBox(const Mat4d& worldFromIndex, const openvdb::CoordBBox& voxels) {
  return transformBox(worldFromIndex, {Vec3d(fromOpenVdb(voxels.min())) - 0.5,
                                       Vec3d(fromOpenVdb(voxels.max())) + 0.5});
}

template <class Value>
double weightOf(const Value& value) {
  const auto v = static_cast<double>(value);
  return v > 0 && std::isfinite(v) ? v : 0.0;
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
         (1 + kReach) * 512.0 * static_cast<double>(base->constBaseTree().leafCount());
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
