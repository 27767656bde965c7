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

// The vectors of any grid as floats, active voxels one by one: a tile of one velocity is rare and
// small beside the smoke.
Vectors::Ptr floatVectors(const Grid& grid, const std::string& path) {
  auto out = Vectors::create(openvdb::Vec3f(0));
  auto write = out->getAccessor();
  const bool vectors = visitVectorGrid(*grid.base(), [&](const auto& typed) {
    for (auto it = typed.cbeginValueOn(); it; ++it) {
      const openvdb::Vec3f value(*it);
      openvdb::CoordBBox box;
      it.getBoundingBox(box);
      for (int x = box.min().x(); x <= box.max().x(); ++x)
        for (int y = box.min().y(); y <= box.max().y(); ++y)
          for (int z = box.min().z(); z <= box.max().z(); ++z)
            write.setValueOn(Coord(x, y, z), value);
    }
  });
  if (!vectors)
    throw InputError(path, fmt::format("grid '{}' is of type {}; a velocity is a vector a voxel",
                                       grid.name(), grid.valueType()));
  return out;
}

// Centred where they were staggered, and in place.
Vectors::Ptr placedVectors(const Vectors& from, bool staggered, const Mat3d& linear,
                           const std::string& name, const std::string& path) {
  auto out = Vectors::create(openvdb::Vec3f(0));
  const auto read = from.getConstAccessor();
  auto write = out->getAccessor();
  for (auto it = from.cbeginValueOn(); it; ++it) {
    const Coord at = it.getCoord();
    Vec3d v(0.0);
    for (int c = 0; c < 3; ++c) {
      v[c] = static_cast<double>((*it)(c));
      Coord next = at;
      next[static_cast<std::size_t>(c)] += 1;
      openvdb::Vec3f above;
      if (staggered && read.probeValue(next, above))
        v[c] = 0.5 * (v[c] + static_cast<double>(above(c)));
    }
    v = linear * v;
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      throw InputError(path, fmt::format("grid '{}' holds a velocity that is not finite at voxel "
                                         "({}, {}, {}); clean the cache",
                                         name, at.x(), at.y(), at.z()));
    write.setValueOn(at, openvdb::Vec3f(static_cast<float>(v.x), static_cast<float>(v.y),
                                        static_cast<float>(v.z)));
  }
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
  const auto read = grid.getConstAccessor();
  Front fresh;
  for (const Coord& at : front)
    forEachNeighbour(at, [&](const Coord& next) {
      if (!read.isValueOn(next)) fresh.push_back(next);
    });
  std::sort(fresh.begin(), fresh.end());
  fresh.erase(std::unique(fresh.begin(), fresh.end()), fresh.end());
  std::vector<openvdb::Vec3f> values;
  for (const Coord& at : fresh) {
    openvdb::Vec3f sum(0);
    float count = 0;
    forEachNeighbour(at, [&](const Coord& next) {
      openvdb::Vec3f v;
      if (!read.probeValue(next, v)) return;
      sum += v;
      count += 1;
    });
    values.push_back(sum / count);
  }
  auto write = grid.getAccessor();
  for (std::size_t i = 0; i < fresh.size(); ++i)
    write.setValueOn(fresh[i], values[i]);
  front = std::move(fresh);
}

// The attribute of that name where it can be a velocity, else nullptr.
const Attribute* velocityColumn(const ParticleSet& particles, const std::string& attribute) {
  const Attribute* v = particles.find(attribute);
  return v && v->arity == 3 && v->size() >= particles.size() ? v : nullptr;
}

bool isInvalid(const Attribute& velocity, std::size_t particle) {
  for (int c = 0; c < 3; ++c)
    if (!std::isfinite(static_cast<float>(velocity.number(particle, c)))) return true;
  return false;
}

}  // namespace

Grid velocityForLookups(const Grid& grid, const Mat3d& linear, int margin,
                        const std::string& path) {
  initializeOpenVdb();
  const bool staggered = grid.base()->getGridClass() == openvdb::GRID_STAGGERED;
  const Vectors::Ptr vectors =
      placedVectors(*floatVectors(grid, path), staggered, linear, grid.name(), path);
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

InvalidVelocities findInvalidVelocities(const ParticleSet& particles,
                                        const std::string& attribute) {
  InvalidVelocities found;
  const Attribute* v = velocityColumn(particles, attribute);
  for (std::size_t i = 0; v && i < particles.size(); ++i)
    if (isInvalid(*v, i) && found.count++ == 0) found.first = i;
  return found;
}

Grid velocityOfParticles(const ParticleSet& particles, const std::string& attribute,
                         const RasterizeOptions& options, const std::string& path) {
  const Attribute* v = velocityColumn(particles, attribute);
  if (!v)
    throw InputError(path, fmt::format("its points have no attribute '{}' of three numbers; set "
                                       "volume.velocity to one that they have, or remove it",
                                       attribute));
  // Masses are not negative: a velocity that all share is added first and taken away again.
  double shift = 0;
  std::vector<double> masses = particleMasses(particles, options);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    if (isInvalid(*v, i)) {
      masses[i] = 0;
      continue;
    }
    if (!options.takes(particles.positions[i])) continue;
    for (int c = 0; c < 3; ++c)
      shift = std::max(shift, std::abs(v->number(i, c)));
  }
  RasterizeOptions same = options;
  ParticleSet weighted = particles;
  weighted.add({"mass", 1, masses});
  const RasterizeResult density = rasterize(weighted, same);
  same.voxelSize = density.voxelSize;
  if (density.density.activeVoxels() == 0) return {};
  const auto* mass = dynamic_cast<const openvdb::FloatGrid*>(density.density.base().get());
  auto out = Vectors::create(openvdb::Vec3f(0));
  out->setTransform(mass->transform().copy());
  out->setName(attribute);
  for (int c = 0; c < 3; ++c) {
    std::vector<double> momenta(masses.size());
    for (std::size_t i = 0; i < masses.size(); ++i)
      momenta[i] = isInvalid(*v, i) ? 0.0 : masses[i] * (v->number(i, c) + shift);
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
