#include "photosphere/volume/velocity.h"

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

using Vectors = openvdb::Vec3SGrid;
using openvdb::Coord;

// Active voxels one by one: a tile of one velocity is rare and small beside the smoke.
Vectors::Ptr copyVectors(const Grid& grid, const Mat3d& linear, const std::string& path) {
  auto out = Vectors::create(openvdb::Vec3f(0));
  const auto copy = [&](const auto& typed) {
    const auto from = typed.deepCopy();
    from->tree().voxelizeActiveTiles();
    const bool staggered = typed.getGridClass() == openvdb::GRID_STAGGERED;
    auto read = from->getConstAccessor();
    auto write = out->getAccessor();
    for (auto it = from->cbeginValueOn(); it; ++it) {
      const Coord at = it.getCoord();
      Vec3d v(0.0);
      for (int c = 0; c < 3; ++c) {
        v[c] = static_cast<double>((*it)[c]);
        if (staggered) {
          Coord next = at;
          next[c] += 1;
          typename std::decay_t<decltype(typed)>::ValueType above;
          if (read.probeValue(next, above)) v[c] = 0.5 * (v[c] + static_cast<double>(above[c]));
        }
      }
      v = linear * v;
      if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
        throw InputError(path, fmt::format("grid '{}' holds a velocity that is not finite at voxel "
                                           "({}, {}, {}); clean the cache",
                                           grid.name(), at.x(), at.y(), at.z()));
      write.setValueOn(at, openvdb::Vec3f(static_cast<float>(v.x), static_cast<float>(v.y),
                                          static_cast<float>(v.z)));
    }
  };
  using Types = openvdb::TypeList<openvdb::Vec3SGrid, openvdb::Vec3DGrid, openvdb::Vec3IGrid>;
  if (!grid.base()->apply<Types>(copy))
    throw InputError(path, fmt::format("grid '{}' is of type {}; a velocity is a vector a voxel",
                                       grid.name(), grid.valueType()));
  return out;
}

using Front = std::vector<Coord>;

template <class Visit>
void forEachNeighbour(const Coord& at, const Visit& visit) {
  for (int i = 0; i < 27; ++i)
    if (i != 13) visit(at.offsetBy(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
}

// One layer of voxels around what is active, each the mean of its active neighbours.
// @param front  voxels that may have an inactive neighbour; then, the new layer
void extend(Vectors& grid, Front& front) {
  openvdb::MaskTree fresh;
  auto isOn = grid.getConstAccessor();
  {
    openvdb::tree::ValueAccessor<openvdb::MaskTree> mark(fresh);
    for (const Coord& at : front)
      forEachNeighbour(at, [&](const Coord& next) {
        if (!isOn.isValueOn(next)) mark.setValueOn(next);
      });
  }
  std::vector<openvdb::Vec3f> values;
  front.clear();
  for (auto it = fresh.cbeginValueOn(); it; ++it) {
    openvdb::Vec3f sum(0);
    float count = 0;
    forEachNeighbour(it.getCoord(), [&](const Coord& next) {
      openvdb::Vec3f v;
      if (!isOn.probeValue(next, v)) return;
      sum += v;
      count += 1;
    });
    front.push_back(it.getCoord());
    values.push_back(sum / count);
  }
  auto write = grid.getAccessor();
  for (std::size_t i = 0; i < front.size(); ++i)
    write.setValueOn(front[i], values[i]);
}

}  // namespace

Grid velocityForLookups(const Grid& grid, const Mat3d& linear, int margin,
                        const std::string& path) {
  initializeOpenVdb();
  const Vectors::Ptr vectors = copyVectors(grid, linear, path);
  Front front;
  if (margin > 0)
    for (auto it = vectors->cbeginValueOn(); it; ++it)
      front.push_back(it.getCoord());
  for (int i = 0; i < margin && !front.empty(); ++i) {
    throwIfInterrupted();
    extend(*vectors, front);
  }
  vectors->setTransform(grid.base()->transform().copy());
  vectors->setName(grid.name());
  return Grid(vectors);
}

Grid velocityOfParticles(const ParticleSet& particles, const std::string& attribute,
                         const RasterizeOptions& options, const std::string& path) {
  const Attribute* v = particles.find(attribute);
  if (!v || v->arity != 3 || v->size() < particles.size())
    throw InputError(path, fmt::format("its points have no attribute '{}' of three numbers; set "
                                       "volume.velocity to one that they have, or remove it",
                                       attribute));
  // Masses are not negative: a velocity that all share is added first and taken away again.
  double shift = 0;
  for (std::size_t i = 0; i < particles.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (const double value = std::abs(v->number(i, c)); std::isfinite(value))
        shift = std::max(shift, value);
  RasterizeOptions same = options;
  const RasterizeResult density = rasterize(particles, same);
  same.voxelSize = density.voxelSize;
  if (density.density.activeVoxels() == 0) return {};
  const auto* mass = dynamic_cast<const openvdb::FloatGrid*>(density.density.base().get());
  auto out = Vectors::create(openvdb::Vec3f(0));
  out->setTransform(mass->transform().copy());
  out->setName(attribute);
  const std::vector<double> masses = particleMasses(particles, options);
  ParticleSet weighted = particles;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> momenta(masses.size());
    for (std::size_t i = 0; i < masses.size(); ++i)
      momenta[i] = masses[i] * (v->number(i, c) + shift);
    weighted.add({"mass", 1, std::move(momenta)});
    const Grid momentum = rasterize(weighted, same).density;
    const auto* p = dynamic_cast<const openvdb::FloatGrid*>(momentum.base().get());
    const auto read = p->getConstAccessor();
    auto write = out->getAccessor();
    for (auto it = mass->cbeginValueOn(); it; ++it) {
      const Coord at = it.getCoord();
      openvdb::Vec3f value = write.getValue(at);
      value[c] = static_cast<float>(
          static_cast<double>(read.getValue(at)) / static_cast<double>(*it) - shift);
      write.setValueOn(at, value);
    }
  }
  return Grid(out);
}

}  // namespace photosphere::volume
