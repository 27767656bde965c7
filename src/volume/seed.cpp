// Particles for a volume that has only a density grid.

#include <algorithm>
#include <cmath>

#include "openvdb_grid.h"
#include "photosphere/core/error.h"
#include "photosphere/core/rng.h"
#include "photosphere/volume/rasterize.h"

namespace photosphere::volume {

namespace {

// A particle's radius over the cube root of the volume that it stands for: about 14 neighbours lie
// within it, which smooths the noise of the seeds without smearing the smoke.
constexpr double kRadiusPerCell = 1.5;
// Thin smoke has few seeds far apart; their radius is bounded by this many times the mean one.
constexpr double kMostRadii = 4;

double positive(double value) {
  return std::isfinite(value) && value > 0 ? value : 0.0;
}

template <class GridT>
double totalMass(const GridT& grid) {
  double sum = 0;  // voxel by voxel, in the order in which seeds are placed
  for (auto it = grid.cbeginValueOn(); it; ++it)
    sum += positive(static_cast<double>(*it)) * static_cast<double>(it.getVoxelCount());
  return sum;
}

struct Seeds {
  std::vector<Vec3d> positions;
  std::vector<double> densities;
};

// Seed j stands where the running mass reaches (j + random) / count of the total: one in each
// stratum.
template <class GridT>
Seeds placeSeeds(const GridT& grid, double total, std::uint64_t count, std::uint64_t seed) {
  Seeds seeds;
  const RandomKey key = RandomKey::fromSeed(seed, 0);
  const double share = total / static_cast<double>(count);
  double running = 0;
  std::uint64_t next = 0;
  Rng rng(key, RandomStream::particles, 0);
  double threshold = rng.uniformDouble() * share;
  for (auto it = grid.cbeginValueOn(); it && next < count; ++it) {
    const double density = positive(static_cast<double>(*it));
    if (density == 0) continue;
    running += density * static_cast<double>(it.getVoxelCount());
    openvdb::CoordBBox box;
    it.getBoundingBox(box);
    const openvdb::Vec3d corner = box.min().asVec3d() - 0.5, size = box.extents().asVec3d();
    while (next < count && threshold < running) {
      const double x = rng.uniformDouble(), y = rng.uniformDouble(), z = rng.uniformDouble();
      const openvdb::Vec3d index = corner + size * openvdb::Vec3d(x, y, z);
      seeds.positions.push_back(fromOpenVdb(grid.transform().indexToWorld(index)));
      seeds.densities.push_back(density);
      rng = Rng(key, RandomStream::particles, ++next);
      threshold = (static_cast<double>(next) + rng.uniformDouble()) * share;
    }
  }
  return seeds;
}

ParticleSet makeParticles(Seeds seeds, double mass, double meanDensity) {
  ParticleSet set;
  std::vector<float> pscale, density;
  const double mean = kRadiusPerCell * std::cbrt(mass / meanDensity);
  for (const double d : seeds.densities) {
    pscale.push_back(
        static_cast<float>(std::min(kRadiusPerCell * std::cbrt(mass / d), kMostRadii * mean)));
    density.push_back(static_cast<float>(d));
  }
  set.add({"mass", 1, std::vector<double>(seeds.positions.size(), mass)});
  set.add({"pscale", 1, std::move(pscale)});
  set.add({"density", 1, std::move(density)});
  set.positions = std::move(seeds.positions);
  return set;
}

}  // namespace

ParticleSet seedParticles(const Grid& density, std::uint64_t count, std::uint64_t seed) {
  if (!density) throw InputError("density grid", "is missing");
  ParticleSet result;
  const double voxelVolume = std::abs(glm::determinant(Mat3d(density.worldFromIndex())));
  const auto place = [&](const auto& grid) {
    const double total = totalMass(grid);
    if (!(total > 0) || count == 0) return;
    Seeds seeds = placeSeeds(grid, total, count, seed);
    double densitySum = 0;
    for (const double d : seeds.densities)
      densitySum += d;
    const double placed = static_cast<double>(seeds.positions.size());
    result = makeParticles(std::move(seeds), total * voxelVolume / placed, densitySum / placed);
  };
  if (!visitScalarGrid(*density.base(), place))
    throw InputError(describe(density), "has no scalar values to seed particles by");
  return result;
}

}  // namespace photosphere::volume
