#include "point_bins.h"

#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "photosphere/core/error.h"
#include "photosphere/core/parallel.h"
#include "photosphere/volume/particle_set.h"

namespace photosphere::volume {

namespace {

Box3d finiteBounds(const std::vector<Vec3d>& positions) {
  Box3d box;
  for (const Vec3d& p : positions)
    if (isPlace(p)) box.grow(p);
  return box;
}

// Spreads the low 21 bits of `v` to every third bit.
std::uint64_t spread(std::uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x1f00000000ffffull;
  v = (v | v << 16) & 0x1f0000ff0000ffull;
  v = (v | v << 8) & 0x100f00f00f00f00full;
  v = (v | v << 4) & 0x10c30c30c30c30c3ull;
  return (v | v << 2) & 0x1249249249249249ull;
}

// Codes of all finite positions on a lattice of 2^21 cells along the box's longest edge: dropping
// 3k low bits gives the code on the lattice that is 2^k times as coarse.
std::vector<std::uint64_t> mortonCodes(const std::vector<Vec3d>& positions, const Box3d& box) {
  const double scale = (0x1p21 - 1) / maxComponent(box.extent());
  std::vector<std::uint64_t> codes;
  codes.reserve(positions.size());
  for (const Vec3d& p : positions) {
    if (!isPlace(p)) continue;
    const Vec3d cell = (p - box.min) * scale;
    codes.push_back(spread(static_cast<std::uint64_t>(cell.x)) |
                    spread(static_cast<std::uint64_t>(cell.y)) << 1 |
                    spread(static_cast<std::uint64_t>(cell.z)) << 2);
  }
  tbb::parallel_sort(codes.begin(), codes.end());
  return codes;
}

double occupancy(const std::vector<std::uint64_t>& codes, int level) {
  std::size_t cells = 1;
  for (std::size_t i = 1; i < codes.size(); ++i)
    cells += (codes[i] >> (3 * level)) != (codes[i - 1] >> (3 * level));
  return static_cast<double>(codes.size()) / static_cast<double>(cells);
}

}  // namespace

std::vector<PointBin> binPoints(const std::vector<Vec3d>& positions,
                                const openvdb::math::Transform& transform) {
  if (positions.size() >= 0xffffffffull)
    throw ConfigError("more than 2^32 particles in one set; split the cache");
  std::vector<PointBin> bins;
  bins.reserve(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (!isPlace(positions[i])) continue;
    const openvdb::Vec3d index = transform.worldToIndex(toOpenVdb(positions[i]));
    const Vec3d rounded = glm::floor(fromOpenVdb(index) + 0.5);
    if (maxComponent(glm::abs(rounded)) > 0x1.fp30)
      throw ConfigError(
          fmt::format("the point voxel size {} is too small for particles so far apart",
                      transform.voxelSize().x()));
    const Vec3i voxel(rounded);
    bins.push_back(
        {voxel >> 3,
         static_cast<std::uint32_t>((voxel.x & 7) << 6 | (voxel.y & 7) << 3 | (voxel.z & 7)),
         static_cast<std::uint32_t>(i)});
  }
  const auto before = [](const PointBin& a, const PointBin& b) {
    return std::tie(a.block.x, a.block.y, a.block.z, a.voxel, a.particle) <
           std::tie(b.block.x, b.block.y, b.block.z, b.voxel, b.particle);
  };
  tbb::parallel_sort(bins.begin(), bins.end(), before);
  return bins;
}

double pointVoxelSize(const std::vector<Vec3d>& positions) {
  constexpr double wanted = 8;
  const Box3d box = finiteBounds(positions);
  const double extent = box.empty() ? 0 : maxComponent(box.extent());
  // Coincident particles: any voxel holds them all; its size only has to resolve their place.
  if (!(extent > 0))
    return box.empty() ? 1.0 : std::max(1.0, maxComponent(glm::abs(box.min)) * 1e-6);
  const std::vector<std::uint64_t> codes = mortonCodes(positions, box);
  const double finest = extent * 0x1p-21;
  double previous = occupancy(codes, 0);
  if (previous >= wanted) return finest;
  for (int level = 1; level <= 21; ++level) {
    const double current = occupancy(codes, level);
    if (current >= wanted) {
      // Occupancy grows like a power of the size between two levels.
      const double t = std::log(wanted / previous) / std::log(current / previous);
      return finest * std::exp2(level - 1 + t);
    }
    previous = current;
  }
  return extent;
}

Mat4d worldFromPointIndex(const std::vector<Vec3d>& positions, double voxelSize) {
  Mat4d matrix(1.0);
  for (int i = 0; i < 3; ++i)
    matrix[i][i] = voxelSize;
  const Box3d box = finiteBounds(positions);
  if (box.empty()) return matrix;
  const Vec3d farthest = glm::max(glm::abs(box.min), glm::abs(box.max)) / voxelSize;
  if (maxComponent(farthest) < 0x1p30) return matrix;
  const Vec3d origin = glm::round(box.center() / voxelSize) * voxelSize;
  matrix[3] = glm::dvec4(origin, 1.0);
  return matrix;
}

bool isGridBookkeeping(std::string_view key) {
  return key == "name" || key == "class" || key == "creator" || key == "is_local_space" ||
         key == "is_saved_as_half_float" || key == "value_type" || key == "vector_type" ||
         key.starts_with("file_");
}

}  // namespace photosphere::volume
