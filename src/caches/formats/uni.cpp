// Mantaflow .uni grids and particles, as Blender's fluid cache writes them.

#include "uni_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "columns.h"
#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "photosphere/volume/vdb_file.h"

namespace photosphere::caches::plugins {
namespace {

namespace fs = std::filesystem;

// Mantaflow, particle.h: ParticleBase::PDELETE and PINVALID.
constexpr std::int32_t kDeleted = (1 << 10) | (1 << 30);

/// `ppSnd_0016` = field `ppSnd` and frame `_0016`.
struct Stem {
  std::string field, frame;
};
Stem stemOf(const fs::path& path) {
  const std::string stem = path.stem().string();
  std::size_t digits = stem.size();
  while (digits > 0 && stem[digits - 1] >= '0' && stem[digits - 1] <= '9')
    --digits;
  std::size_t cut = digits;
  if (cut > 0 && stem[cut - 1] == '_') --cut;
  if (cut == 0) return {stem, ""};
  return {stem.substr(0, cut), stem.substr(cut)};
}

/// Other .uni files of the same frame, by name.
std::vector<fs::path> filesOfFrame(const fs::path& path) {
  std::vector<fs::path> found;
  const std::string frame = stemOf(path).frame;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const fs::path& other = at->path();
    if (lowered(other.extension().string()) == ".uni" && stemOf(other).frame == frame &&
        other.filename() != path.filename())
      found.push_back(other);
  }
  std::sort(found.begin(), found.end());
  return found;
}

struct Domain {
  double voxelSize = 1;
  Vec3d corner{0};
};

Domain domainOf(const UniFile& uni, const ParamValues& options, CacheContent& content) {
  Domain domain{options.real("voxel_size"), options.vec3("origin")};
  if (domain.voxelSize > 0) return domain;
  const int longest = std::max({uni.dim.x, uni.dim.y, uni.dim.z, 1});
  domain.voxelSize = 1.0 / longest;
  const std::string note =
      "the file does not say where its domain lies: its longest side is taken as 1 "
      "scene unit; give options 'voxel_size' and 'origin'";
  if (std::find(content.notes.begin(), content.notes.end(), note) == content.notes.end())
    content.notes.push_back(note);
  return domain;
}

/// Means of the two faces of each cell. The far face of the last cell is outside the file: its near
/// face stands in.
void centreStaggered(std::vector<float>& values, const Vec3i& dim) {
  const std::size_t nx = static_cast<std::size_t>(dim.x), ny = static_cast<std::size_t>(dim.y),
                    nz = static_cast<std::size_t>(dim.z);
  // Ascending order reads every far face before it is overwritten.
  for (std::size_t z = 0; z < nz; ++z)
    for (std::size_t y = 0; y < ny; ++y)
      for (std::size_t x = 0; x < nx; ++x) {
        const std::size_t cell = (z * ny + y) * nx + x;
        if (x + 1 < nx) values[3 * cell] = 0.5f * (values[3 * cell] + values[3 * (cell + 1)]);
        if (y + 1 < ny)
          values[3 * cell + 1] = 0.5f * (values[3 * cell + 1] + values[3 * (cell + nx) + 1]);
        if (z + 1 < nz)
          values[3 * cell + 2] = 0.5f * (values[3 * cell + 2] + values[3 * (cell + nx * ny) + 2]);
      }
}

void addGrid(UniFile& uni, const ParamValues& options, CacheContent& content) {
  const std::string field = stemOf(uni.path).field;
  const std::string name = field == "heat" ? "temperature" : field == "vel" ? "velocity" : field;
  const Domain domain = domainOf(uni, options, content);
  // Values belong to cell centres.
  Mat4d worldFromIndex(1.0);
  for (int axis = 0; axis < 3; ++axis) {
    worldFromIndex[axis][axis] = domain.voxelSize;
    worldFromIndex[3][axis] = domain.corner[axis] + 0.5 * domain.voxelSize;
  }
  if (uni.arity == 3) {
    if (uni.gridType & kUniMac) {
      centreStaggered(uni.reals, uni.dim);
      content.notes.push_back(
          fmt::format("grid '{}' was staggered (MAC); averaged to cell centres", name));
    }
    content.notes.push_back(
        fmt::format("grid '{}' is in the solver's units (cells a solver second); "
                    "scale it to scene units a second",
                    name));
    content.grids.push_back(volume::denseVectorToGrid(name, uni.dim, uni.reals, worldFromIndex));
    return;
  }
  if (!uni.integers.empty()) uni.reals.assign(uni.integers.begin(), uni.integers.end());
  content.grids.push_back(volume::denseToGrid(name, uni.dim, uni.reals, worldFromIndex));
}

/// Keeps the elements of a column whose particle is alive.
template <class T>
std::vector<T> alive(const std::vector<T>& values, const std::vector<std::int32_t>& flags,
                     std::size_t arity) {
  std::vector<T> kept;
  kept.reserve(values.size());
  for (std::size_t i = 0; i < flags.size(); ++i)
    if (!(flags[i] & kDeleted))
      for (std::size_t c = 0; c < arity; ++c)
        kept.push_back(values[i * arity + c]);
  return kept;
}

void addAttribute(const UniFile& data, const std::string& name,
                  const std::vector<std::int32_t>& flags, volume::ParticleSet& set) {
  const std::size_t arity = static_cast<std::size_t>(data.arity);
  volume::Attribute attribute{attributeName(name), data.arity, {}};
  if (data.integers.empty())
    attribute.data = alive(data.reals, flags, arity);
  else
    attribute.data = alive(data.integers, flags, arity);
  set.add(std::move(attribute));
}

/// `pVelSnd` belongs to `ppSnd`: its attribute is `Vel`. Empty when it does not.
std::string attributeOf(const std::string& field, const std::string& particles) {
  const std::string group = particles.substr(2);
  if (field.size() <= group.size() + 1 || field[0] != 'p' || !field.ends_with(group)) return {};
  std::string name = field.substr(1, field.size() - group.size() - 1);
  // In the group without a suffix, `pVelSnd` is of another group.
  if (name[0] < 'A' || name[0] > 'Z' || (group.empty() && name.ends_with("Snd"))) return {};
  return name;
}

void addParticles(const UniFile& uni, const ParamValues& options, CacheContent& content) {
  const Domain domain = domainOf(uni, options, content);
  const std::string field = stemOf(uni.path).field;
  volume::ParticleSet set;
  const std::vector<float> cells = alive(uni.reals, uni.integers, 3);
  set.positions.reserve(cells.size() / 3);
  for (std::size_t i = 0; i < cells.size(); i += 3)
    set.positions.push_back(domain.corner +
                            domain.voxelSize * Vec3d(cells[i], cells[i + 1], cells[i + 2]));
  volume::Attribute flags{"flags", 1, alive(uni.integers, uni.integers, 1)};
  set.add(std::move(flags));
  if (set.size() < uni.count)
    content.notes.push_back(fmt::format("{} deleted particles left out", uni.count - set.size()));
  if (field.starts_with("pp"))
    for (const fs::path& other : filesOfFrame(uni.path)) {
      const std::string name = attributeOf(stemOf(other).field, field);
      if (name.empty()) continue;
      const UniFile data = readUni(other);
      if (data.kind != UniKind::particleData) continue;
      if (data.count != uni.count)
        throw InputError(data.path,
                         fmt::format("has {} values for the {} particles of {}; bake again",
                                     data.count, uni.count, uni.path));
      addAttribute(data, name, uni.integers, set);
      content.notes.push_back("attribute from " + other.filename().string());
    }
  content.particles.push_back(std::move(set));
  content.particleNames.push_back(field);
}

void addFile(const fs::path& path, const ParamValues& options, CacheContent& content) {
  UniFile uni = readUni(path);
  if (uni.kind == UniKind::grid)
    addGrid(uni, options, content);
  else if (uni.kind == UniKind::particles)
    addParticles(uni, options, content);
  else
    throw InputError(uni.path,
                     "holds an attribute of particles; name the file of their positions "
                     "(pp_####.uni), which brings its attributes along");
}

bool recognize(std::string_view head) {
  return isUni(head);
}

CacheContent read(const fs::path& path, const ParamValues& options) {
  CacheContent content;
  addFile(path, options, content);
  if (!options.flag("whole_frame")) return content;
  for (const fs::path& other : filesOfFrame(path)) {
    const std::string field = stemOf(other).field;
    if (field == "config" || (field.starts_with("p") && !field.starts_with("pp") &&
                              field.size() > 1 && field[1] >= 'A' && field[1] <= 'Z'))
      continue;  // settings; attributes, which come with their particles
    addFile(other, options, content);
  }
  return content;
}

constexpr Param kParams[] = {
    {.name = "voxel_size",
     .type = ParamType::real,
     .unit = "scene units",
     .defaultText = "0",
     .help = "edge of one cell; 0 = the longest side of the domain is 1",
     .min = 0},
    {.name = "origin",
     .type = ParamType::vec3,
     .unit = "scene units",
     .defaultText = "[0, 0, 0]",
     .help = "lowest corner of the domain"},
    {.name = "whole_frame",
     .type = ParamType::boolean,
     .unit = "",
     .defaultText = "false",
     .help = "also read the other .uni files of the same frame in the folder"},
};
constexpr std::string_view kExtensions[] = {".uni"};

}  // namespace

extern const CacheFormat uni;
const CacheFormat uni = {
    "uni",  "Mantaflow (Blender) grids and particles", kParams, kExtensions, recognize, read,
    nullptr};

}  // namespace photosphere::caches::plugins
