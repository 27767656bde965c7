#include "photosphere/volume/velocity.h"

#include <fmt/format.h>
#include <openvdb/tools/Morphology.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "openvdb_grid.h"
#include "photosphere/core/error.h"
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

// One layer of voxels around what is active, each the mean of its active neighbours.
void extend(Vectors& grid) {
  const openvdb::MaskTree before(grid.tree(), false, true, openvdb::TopologyCopy());
  openvdb::tools::dilateActiveValues(grid.tree(), 1, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::EXPAND_TILES);
  const openvdb::tree::ValueAccessor<const openvdb::MaskTree> old(before);
  const auto values = std::as_const(grid).getConstAccessor();
  std::vector<std::pair<Coord, openvdb::Vec3f>> fresh;
  for (auto it = grid.cbeginValueOn(); it; ++it) {
    const Coord at = it.getCoord();
    if (old.isValueOn(at)) continue;
    openvdb::Vec3f sum(0);
    float count = 0;
    for (int i = 0; i < 27; ++i) {
      const Coord next = at.offsetBy(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      if (!old.isValueOn(next)) continue;
      sum += values.getValue(next);
      count += 1;
    }
    fresh.emplace_back(at, count > 0 ? sum / count : openvdb::Vec3f(0));
  }
  auto write = grid.getAccessor();
  for (const auto& [at, v] : fresh)
    write.setValueOn(at, v);
}

}  // namespace

Grid velocityForLookups(const Grid& grid, const Mat3d& linear, int margin,
                        const std::string& path) {
  initializeOpenVdb();
  const Vectors::Ptr vectors = copyVectors(grid, linear, path);
  for (int i = 0; i < margin && !vectors->empty(); ++i)
    extend(*vectors);
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
