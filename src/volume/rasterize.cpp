#include "photosphere/volume/rasterize.h"

#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <tuple>

#include "openvdb_grid.h"
#include "photosphere/core/error.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/parallel.h"
#include "photosphere/core/resources.h"
#include "point_bins.h"
#include "splats.h"

namespace photosphere::volume {

namespace {

using DensityLeaf = openvdb::FloatTree::LeafNodeType;

// A splat in a cubic tile of voxels that it touches. Sorted by tile, then by splat: the order of a
// tile's sums is that of the particles, whatever thread forms them.
struct Visit {
  Vec3i tile;
  std::uint32_t splat;
};

struct TileResult {
  std::vector<std::unique_ptr<DensityLeaf>> leaves;
  double sum = 0;  ///< of the voxels as stored
};

class Rasterizer {
 public:
  Rasterizer(const std::vector<Blob>& blobs, const Mat4d& worldFromIndex, double voxelSize)
      : m_budget(static_cast<double>(availableMemoryBytes()) * 0.8),
        m_inverseVolume(1.0 / (voxelSize * voxelSize * voxelSize)) {
    checkLargest(blobs, voxelSize);
    makeSplats(blobs, Vec3d(worldFromIndex[3]), voxelSize);
    chooseTiles();
    makeVisits();
  }

  // Returns the sum of all voxels.
  double fill(openvdb::FloatTree& tree) {
    std::vector<std::size_t> starts;
    for (std::size_t i = 0; i < m_visits.size(); ++i)
      if (i == 0 || m_visits[i].tile != m_visits[i - 1].tile) starts.push_back(i);
    starts.push_back(m_visits.size());
    std::vector<TileResult> tiles(starts.size() - 1);
    parallelFor(tiles.size(), 4, [&](std::size_t begin, std::size_t end) {
      const auto edge = static_cast<std::size_t>(m_edge);
      std::vector<double> buffer(edge * edge * edge);
      for (std::size_t i = begin; i < end; ++i)
        fillTile(starts[i], starts[i + 1], buffer, tiles[i]);
    });
    double sum = 0;
    for (TileResult& tile : tiles) {
      sum += tile.sum;
      for (std::unique_ptr<DensityLeaf>& leaf : tile.leaves)
        tree.addLeaf(leaf.release());
    }
    return sum;
  }

 private:
  // The grid has no fewer voxels than its largest kernel; said before anyone walks over them.
  void checkLargest(const std::vector<Blob>& blobs, double voxelSize) {
    double largest = 0;
    for (const Blob& blob : blobs)
      largest = std::max(largest, blob.radius / voxelSize);
    const double bytes = 4.0 / 3.0 * kPi * largest * largest * largest * sizeof(float);
    if (bytes > m_budget) refuse(blobs.size());
  }

  [[noreturn]] void refuse(std::size_t particles) const {
    throw MemoryError(
        fmt::format("rasterizing {} particles needs more than the {} of memory that "
                    "are free; give a larger voxel size",
                    particles, formatBytes(static_cast<std::uint64_t>(m_budget / 0.8))));
  }

  void makeSplats(const std::vector<Blob>& blobs, const Vec3d& origin, double voxelSize) {
    m_splats.resize(blobs.size());
    const double mostReach = 0x1p29;
    parallelFor(blobs.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        throwIfInterrupted();  // each may span millions of voxels
        Splat& splat = m_splats[i];
        splat.center = (blobs[i].position - origin) / voxelSize;
        splat.radius = blobs[i].radius / voxelSize;
        if (!(maxComponent(glm::abs(splat.center)) < 0x1p30) || !(splat.radius < mostReach))
          throw ConfigError(
              fmt::format("voxel size {} is too small for a volume so large; give a "
                          "larger one",
                          voxelSize));
        double sum = 0;
        splat.forEachVoxel(splat.first(), splat.last(),
                           [&](int, int, int, double weight) { sum += weight; });
        splat.scale = sum > 0 ? blobs[i].mass / sum : -blobs[i].mass;
        if (!(sum > 0)) splat.radius = 0;
      }
    });
  }

  // A tile about twice as wide as a typical splat keeps the visits to a few a splat.
  void chooseTiles() {
    std::vector<double> radii;
    for (const Splat& splat : m_splats)
      radii.push_back(splat.radius);
    if (radii.empty()) return;
    const auto high = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() * 9 / 10);
    std::nth_element(radii.begin(), high, radii.end());
    while (m_edge < 64 && m_edge < 4 * *high)
      m_edge *= 2;
    m_shift = m_edge == 16 ? 4 : m_edge == 32 ? 5 : 6;
  }

  void makeVisits() {
    double visits = 0;
    for (const Splat& splat : m_splats) {
      const Vec3d tiles((splat.last() >> m_shift) - (splat.first() >> m_shift) + 1);
      visits += tiles.x * tiles.y * tiles.z;
    }
    spend(visits * sizeof(Visit));
    m_visits.reserve(static_cast<std::size_t>(visits));
    for (std::size_t i = 0; i < m_splats.size(); ++i) {
      throwIfInterrupted();
      const Vec3i lo = m_splats[i].first() >> m_shift, hi = m_splats[i].last() >> m_shift;
      for (int x = lo.x; x <= hi.x; ++x)
        for (int y = lo.y; y <= hi.y; ++y)
          for (int z = lo.z; z <= hi.z; ++z)
            m_visits.push_back({Vec3i(x, y, z), static_cast<std::uint32_t>(i)});
    }
    tbb::parallel_sort(m_visits.begin(), m_visits.end(), [](const Visit& a, const Visit& b) {
      return std::tie(a.tile.x, a.tile.y, a.tile.z, a.splat) <
             std::tie(b.tile.x, b.tile.y, b.tile.z, b.splat);
    });
  }

  std::size_t place(int x, int y, int z) const {
    return static_cast<std::size_t>(((x & (m_edge - 1)) * m_edge + (y & (m_edge - 1))) * m_edge +
                                    (z & (m_edge - 1)));
  }

  void fillTile(std::size_t begin, std::size_t end, std::vector<double>& buffer,
                TileResult& result) {
    const Vec3i corner = m_visits[begin].tile * m_edge;
    std::fill(buffer.begin(), buffer.end(), 0.0);
    for (std::size_t i = begin; i < end; ++i) {
      throwIfInterrupted();  // all particles may lie in one tile
      const Splat& splat = m_splats[m_visits[i].splat];
      if (splat.scale < 0) {
        const Vec3i at(glm::floor(splat.center + 0.5));
        buffer[place(at.x, at.y, at.z)] -= splat.scale;
        continue;
      }
      splat.forEachVoxel(glm::max(splat.first(), corner),
                         glm::min(splat.last(), corner + (m_edge - 1)),
                         [&](int x, int y, int z, double weight) {
                           buffer[place(x, y, z)] += weight * splat.scale;
                         });
    }
    for (int x = 0; x < m_edge; x += 8)
      for (int y = 0; y < m_edge; y += 8)
        for (int z = 0; z < m_edge; z += 8)
          makeLeaf(corner + Vec3i(x, y, z), buffer, result);
    spend(static_cast<double>(result.leaves.size()) * (sizeof(DensityLeaf) + 512 * sizeof(float)));
  }

  void makeLeaf(const Vec3i& corner, const std::vector<double>& buffer, TileResult& result) {
    std::unique_ptr<DensityLeaf> leaf;
    for (openvdb::Index i = 0; i < DensityLeaf::SIZE; ++i) {
      const Vec3i local(i >> 6, (i >> 3) & 7, i & 7);
      const double mass = buffer[place(corner.x + local.x, corner.y + local.y, corner.z + local.z)];
      const auto density = static_cast<float>(mass * m_inverseVolume);
      if (!(density > 0)) continue;
      if (!leaf)
        leaf = std::make_unique<DensityLeaf>(openvdb::Coord(corner.x, corner.y, corner.z), 0.0f,
                                             false);
      leaf->setValueOn(i, density);
      result.sum += static_cast<double>(density);
    }
    if (leaf) result.leaves.push_back(std::move(leaf));
  }

  // Counts memory before it is asked for: the system would rather kill than refuse.
  void spend(double bytes) {
    double spent = m_spent.load();
    while (!m_spent.compare_exchange_weak(spent, spent + bytes)) {
    }
    if (spent + bytes > m_budget) refuse(m_splats.size());
  }

  double m_budget;
  double m_inverseVolume;
  std::atomic<double> m_spent{0};
  int m_edge = 16, m_shift = 4;  // tile edge [voxels] and its logarithm
  std::vector<Splat> m_splats;
  std::vector<Visit> m_visits;
};

// A particle that is far larger than most would make voxels so large that the others vanish.
void checkRadii(const RasterizeResult& result) {
  // Its kernel in voxels of half the median radius would be 2^28 of them and more.
  constexpr double kMostRatio = 200;
  if (!(result.radiusMax > kMostRatio * result.radiusMedian) || !(result.radiusMedian > 0)) return;
  throw MemoryError(fmt::format(
      "the largest particle radius, {:.4g}, is {:.3g} times their median: voxels that fit the "
      "others would take more than 1 GiB for that one alone. Clean the cache, or give one radius "
      "for all (volume.particle_radius, convert --radius) or a larger voxel size (convert "
      "--voxel-size)",
      result.radiusMax, result.radiusMax / result.radiusMedian));
}

}  // namespace

RasterizeResult rasterize(const ParticleSet& particles, const RasterizeOptions& options) {
  if (!(options.voxelSize >= 0) || !(options.radius >= 0) || !std::isfinite(options.voxelSize) ||
      !std::isfinite(options.radius))
    throw ConfigError(fmt::format("voxel size {} and radius {} must not be negative",
                                  options.voxelSize, options.radius));
  initializeOpenVdb();
  RasterizeResult result;
  std::vector<Blob> blobs = collectBlobs(particles, options, result);
  if (options.leaveOutStrays) result.strays = findStrays(blobs);
  if (const Box3d& within = result.strays ? result.strays->kept : options.within; !within.empty()) {
    std::erase_if(blobs, [&](const Blob& blob) {
      const bool out = !within.contains(blob.position);
      if (out) result.massParticles -= blob.mass;
      return out;
    });
    summarizeRadii(blobs, result);
  }
  if (options.voxelSize == 0) checkRadii(result);
  result.voxelSize = chooseVoxelSize(blobs, options, result.radiusMedian);
  std::vector<Vec3d> positions;
  positions.reserve(2);
  Box3d box;
  for (const Blob& blob : blobs)
    box.grow(blob.position);
  if (!blobs.empty()) positions = {box.min, box.max};
  const Mat4d worldFromIndex = worldFromPointIndex(positions, result.voxelSize);

  auto grid = openvdb::FloatGrid::create(0.0f);
  Rasterizer rasterizer(blobs, worldFromIndex, result.voxelSize);
  blobs = {};
  const double sum = rasterizer.fill(grid->tree());
  result.massGrid = sum * result.voxelSize * result.voxelSize * result.voxelSize;
  grid->setTransform(makeTransform(worldFromIndex));
  grid->setName("density");
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  result.density = Grid(grid);
  return result;
}

}  // namespace photosphere::volume
