#include "photosphere/estimators/light_cache.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <map>

#include "photosphere/core/error.h"
#include "photosphere/core/version.h"
#include "photosphere/estimators/layout_names.h"
#include "photosphere/sphere/spherical_harmonics.h"
#include "photosphere/volume/vdb_file.h"

namespace photosphere::estimators {

namespace {

using Metadata = std::map<std::string, std::string>;

constexpr const char* kGridName = "light";
constexpr const char* kFormat = "photosphere light cache 1";

// Numbers as text that reads back to the same bits.
std::string exact(double v) {
  return fmt::format("{}", v);
}
std::string exact(const Vec3d& v) {
  return fmt::format("{} {} {}", v.x, v.y, v.z);
}

// Reads metadata entries, each by its type, with errors that name the file.
class Reader {
 public:
  Reader(std::string path, Metadata metadata)
      : m_path(std::move(path)), m_metadata(std::move(metadata)) {}

  bool has(const std::string& key) const { return m_metadata.count(key) != 0; }
  const std::string& text(const std::string& key) const {
    const auto found = m_metadata.find(key);
    if (found == m_metadata.end())
      throw InputError(m_path, fmt::format("is not a light cache of this version: it lacks the "
                                           "metadata '{}'; trace it again",
                                           key));
    return found->second;
  }
  double number(const std::string& key) const { return numbers(key, 1)[0]; }
  std::vector<double> numbers(const std::string& key, std::size_t count) const {
    std::vector<double> values;
    std::string_view rest = text(key);
    while (!rest.empty()) {
      double v = 0;
      const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), v);
      if (error != std::errc() || !std::isfinite(v)) break;
      values.push_back(v);
      rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
      if (!rest.empty() && rest.front() == ' ') rest.remove_prefix(1);
    }
    if (values.size() != count || !rest.empty()) bad(key);
    return values;
  }
  int whole(const std::string& key, int low, int high) const {
    const double v = number(key);
    if (!(v >= low && v <= high) || v != std::floor(v)) bad(key);
    return static_cast<int>(v);
  }
  std::uint64_t count(const std::string& key) const {
    const double v = number(key);
    if (!(v >= 0 && v <= 0x1p63)) bad(key);
    return static_cast<std::uint64_t>(v);
  }
  template <class E>
  E choice(const std::string& key) const {
    if (const std::optional<E> value = named<E>(text(key))) return *value;
    bad(key);
  }
  [[noreturn]] void bad(const std::string& key) const {
    throw InputError(m_path,
                     fmt::format("metadata '{}' holds '{}', which no light cache has; trace it "
                                 "again",
                                 key, text(key)));
  }

 private:
  std::string m_path;
  Metadata m_metadata;
};

Metadata describe(const LightField& field, const LightCacheKey& key) {
  const LightFieldLayout& l = field.layout;
  Metadata m;
  m["photosphere_format"] = kFormat;
  m["photosphere_version"] = versionText();
  m["quantity"] = l.holdsPower() ? "power [W]" : "fluence rate [W m^-2]";
  m["carrier"] = nameOf(l.carrier);
  m["basis"] = nameOf(l.basis);
  if (l.basis == Basis::sphericalHarmonics) m["order"] = std::to_string(l.order);
  m["deposit"] = nameOf(l.deposit);
  m["energy"] = nameOf(l.energy);
  m["spatial_kernel"] = nameOf(l.kernel);
  m["rows"] = std::to_string(l.rows);
  m["direction"] = nameOf(l.direction);
  m["representative"] = nameOf(l.representative);
  if (l.direction == sphere::DirectionDeposit::kernel) {
    m["kernel"] = nameOf(l.angularKernel);
    m["bandwidth"] = exact(l.bandwidth);
    m["truncation"] = exact(l.truncation);
  }
  m["channels"] = std::to_string(l.channels);
  m["phases"] = std::to_string(l.phases);
  m["unscattered"] = std::string(1, l.unscattered ? '1' : '0');
  m["light_voxel"] = exact(l.lightVoxel);
  m["radius_m"] = exact(l.radius);
  m["deposit_radius_m"] = exact(l.depositRadius);
  m["photons"] = std::to_string(field.photons);
  m["far_photons"] = std::to_string(field.farPhotons);
  m["medium_hash"] = key.mediumHash;
  m["light_hash"] = key.lightHash;
  m["local_center"] = exact(key.space.center);
  m["meters_per_unit"] = exact(key.space.metersPerUnit);
  m["carriers"] = std::to_string(field.carriers());
  if (l.carrier == Carrier::voxels) {
    m["lattice_origin_m"] = exact(field.lattice.origin());
    m["lattice_edge_m"] = exact(field.lattice.edge());
    m["lattice_bricks"] = exact(Vec3d(field.lattice.bricks()));
  }
  return m;
}

// Attribute of the values themselves.
std::string valuesName(const LightFieldLayout& layout) {
  return layout.basis == Basis::histogram ? "photon_histogram" : "photon_harmonics";
}

// One set of values as strided attributes: bins, their sum, and mean directions where they are
// kept.
void addSet(volume::ParticleSet& points, const LightField& field, std::size_t set,
            const std::string& suffix) {
  const LightFieldLayout& l = field.layout;
  const auto stride = static_cast<std::size_t>(l.valuesPerCarrier());
  const auto size = static_cast<std::size_t>(l.setSize());
  const auto light = static_cast<std::size_t>(l.bins() * l.channels);
  const auto channels = static_cast<std::size_t>(l.channels);
  std::vector<float> histogram, energy, directions;
  histogram.reserve(field.carriers() * light);
  energy.reserve(field.carriers() * channels);
  directions.reserve(field.carriers() * (size - light));
  for (std::size_t i = 0; i < field.carriers(); ++i) {
    const float* values = field.values.data() + i * stride + set * size;
    histogram.insert(histogram.end(), values, values + light);
    directions.insert(directions.end(), values + light, values + size);
    for (std::size_t c = 0; c < channels; ++c) {
      double sum = 0;
      if (l.basis == Basis::histogram)
        for (std::size_t j = c; j < light; j += channels)
          sum += static_cast<double>(values[j]);
      else  // the first harmonic is 1 / sqrt(4 pi) everywhere
        sum = std::sqrt(4 * kPi) * static_cast<double>(values[c]);
      energy.push_back(static_cast<float>(sum));
    }
  }
  points.add({valuesName(l) + suffix, static_cast<int>(light), std::move(histogram)});
  points.add({fmt::format("photon_energy{}", suffix), l.channels, std::move(energy)});
  if (l.keepsMeans())
    points.add({fmt::format("photon_direction{}", suffix), 3 * l.bins(), std::move(directions)});
}

const std::vector<float>& floats(const volume::ParticleSet& points, const std::string& name,
                                 std::size_t count, const std::string& path) {
  const volume::Attribute* attribute = points.find(name);
  const auto* data = attribute ? std::get_if<std::vector<float>>(&attribute->data) : nullptr;
  if (!data || data->size() != count)
    throw InputError(
        path, fmt::format("the light cache lacks {} values of '{}'; trace it again", count, name));
  return *data;
}

}  // namespace

void writeLightCache(const std::filesystem::path& path, const LightField& field,
                     const LightCacheKey& key) {
  if (field.layout.basis == Basis::view)
    throw ConfigError(
        "a light cache serves every camera, and the view basis belongs to one; set "
        "estimator.basis = \"histogram\", \"spherical_harmonics\" or \"auto\"");
  volume::ParticleSet points;
  const bool voxels = field.layout.carrier == Carrier::voxels;
  points.positions.reserve(field.carriers());
  std::vector<std::int32_t> order;
  std::vector<float> local;
  for (std::size_t i = 0; i < field.carriers(); ++i) {
    const Vec3d p = voxels ? field.lattice.origin() +
                                 (Vec3d(field.lattice.voxel(i)) + 0.5) * field.lattice.edge()
                           : Vec3d(field.particles[i]);
    points.positions.push_back(key.space.worldFromLocal(p));
    order.push_back(static_cast<std::int32_t>(i));
    if (!voxels)
      local.insert(local.end(), {field.particles[i].x, field.particles[i].y, field.particles[i].z});
  }
  addSet(points, field, 0, "");
  if (field.layout.unscattered) addSet(points, field, 1, "_unscattered");
  // The carriers' own numbering, and for particles the positions the tracer used, to the bit.
  points.add({"light_order", 1, std::move(order)});
  if (!voxels) points.add({"light_local", 3, std::move(local)});
  points.metadata = describe(field, key);
  // Light voxels sit alone in their point voxel; particles are binned by default.
  const double voxelSize = voxels ? field.lattice.edge() / key.space.metersPerUnit : 0.0;
  volume::writeVdb(path, {volume::pointsToGrid(points, kGridName, voxelSize)});
}

LightField readLightCache(const std::filesystem::path& path, const LightCacheKey& expected,
                          bool allowStale) {
  const volume::VdbFile file = volume::readVdb(path);
  const volume::Grid* grid = file.tryFind(kGridName);
  if (!grid || grid->kind() != volume::GridKind::points)
    throw InputError(path.string(),
                     "is not a light cache: it has no point grid named 'light' (make one "
                     "with `photosphere trace SCENE -o LIGHT.vdb`)");
  const volume::ParticleSet points = volume::gridToPoints(*grid);
  const Reader m(path.string(), points.metadata);
  if (m.text("photosphere_format") != kFormat) m.bad("photosphere_format");
  if (!allowStale)
    for (const auto& [key, now] :
         {std::pair<std::string, std::string>{"medium_hash", expected.mediumHash},
          {"light_hash", expected.lightHash}})
      if (m.text(key) != now)
        throw InputError(
            path.string(),
            fmt::format("is stale: its {} was {} when it was traced and is {} now; trace "
                        "it again, or use it as it is with --allow-stale",
                        key == "medium_hash" ? "smoke" : "light", m.text(key), now));

  LightField field;
  LightFieldLayout& l = field.layout;
  l.carrier = m.choice<Carrier>("carrier");
  l.basis = m.choice<Basis>("basis");
  if (l.basis == Basis::view) m.bad("basis");  // belongs to one camera and has no cache
  if (l.basis == Basis::sphericalHarmonics)
    l.order = m.whole("order", 0, sphere::SphericalHarmonics::kMaxOrder);
  l.deposit = m.choice<Deposit>("deposit");
  l.energy = m.choice<EnergyRule>("energy");
  l.kernel = m.choice<SpatialKernel>("spatial_kernel");
  l.rows = m.whole("rows", 1, 64);
  // Caches written before these choices existed hold their defaults.
  if (m.has("direction")) l.direction = m.choice<sphere::DirectionDeposit>("direction");
  if (m.has("representative")) l.representative = m.choice<Representative>("representative");
  if (l.direction == sphere::DirectionDeposit::kernel) {
    l.angularKernel = m.choice<sphere::AngularKernel>("kernel");
    l.bandwidth = m.number("bandwidth");
    l.truncation = m.number("truncation");
    if (!(l.bandwidth >= 1e-4 && l.bandwidth <= 1e4)) m.bad("bandwidth");
    if (!(l.truncation > 0)) m.bad("truncation");
    if (l.angularKernel == sphere::AngularKernel::none) m.bad("kernel");
  }
  l.channels = m.whole("channels", 1, 3);
  if (l.channels == 2) m.bad("channels");
  l.phases = m.whole("phases", 1, transport::kMaxPhases);
  l.unscattered = m.whole("unscattered", 0, 1) == 1;
  l.lightVoxel = m.number("light_voxel");
  l.radius = m.number("radius_m");
  l.depositRadius = m.number("deposit_radius_m");
  if (!(l.lightVoxel > 0)) m.bad("light_voxel");
  field.photons = m.count("photons");
  field.farPhotons = m.count("far_photons");

  // Where each point belongs in the traced numbering.
  const std::size_t count = points.size();
  const volume::Attribute* orderColumn = points.find("light_order");
  const auto* order =
      orderColumn ? std::get_if<std::vector<std::int32_t>>(&orderColumn->data) : nullptr;
  if (!order || order->size() != count || m.number("carriers") != static_cast<double>(count))
    throw InputError(path.string(), "the light cache is not whole; trace it again");
  std::vector<std::uint8_t> seen(count, 0);
  for (const std::int32_t i : *order) {
    if (i < 0 || static_cast<std::size_t>(i) >= count || seen[static_cast<std::size_t>(i)])
      throw InputError(path.string(),
                       "the light cache numbers its carriers wrongly; trace it again");
    seen[static_cast<std::size_t>(i)] = 1;
  }

  const auto size = static_cast<std::size_t>(l.setSize());
  const auto light = static_cast<std::size_t>(l.bins() * l.channels);
  const auto stride = static_cast<std::size_t>(l.valuesPerCarrier());
  // All are there before room is made for them.
  struct Column {
    const std::vector<float>* from;
    std::size_t width, offset;
  };
  std::vector<Column> columns;
  const auto place = [&](const std::string& name, std::size_t width, std::size_t offset) {
    columns.push_back({&floats(points, name, count * width, path.string()), width, offset});
  };
  for (std::size_t set = 0; set < (l.unscattered ? 2u : 1u); ++set) {
    const std::string suffix = set ? "_unscattered" : "";
    place(valuesName(l) + suffix, light, set * size);
    if (l.keepsMeans()) place("photon_direction" + suffix, size - light, set * size + light);
  }
  field.values.resize(count * stride);
  for (const Column& c : columns)
    for (std::size_t i = 0; i < count; ++i)
      std::copy_n(c.from->data() + i * c.width, c.width,
                  field.values.data() + static_cast<std::size_t>((*order)[i]) * stride + c.offset);
  if (l.carrier == Carrier::particles) {
    const auto& local = floats(points, "light_local", count * 3, path.string());
    field.particles.resize(count);
    for (std::size_t i = 0; i < count; ++i)
      field.particles[static_cast<std::size_t>((*order)[i])] = {local[3 * i], local[3 * i + 1],
                                                                local[3 * i + 2]};
    return field;
  }
  const auto origin = m.numbers("lattice_origin_m", 3);
  const auto bricks = m.numbers("lattice_bricks", 3);
  const double edge = m.number("lattice_edge_m");
  const auto center = m.numbers("local_center", 3);
  const double metersPerUnit = m.number("meters_per_unit");
  for (const double b : bricks)
    if (!(b >= 1 && b <= 1e6)) m.bad("lattice_bricks");
  if (!(edge > 0)) m.bad("lattice_edge_m");
  // Their table takes memory for each. Smoke so thin in so large a box is none.
  if (bricks[0] * bricks[1] * bricks[2] > 1e6 + 4096.0 * static_cast<double>(count))
    m.bad("lattice_bricks");
  const Vec3i brickCount(static_cast<int>(bricks[0]), static_cast<int>(bricks[1]),
                         static_cast<int>(bricks[2]));
  const Vec3d latticeOrigin(origin[0], origin[1], origin[2]);
  const lights::LocalSpace space{Vec3d(center[0], center[1], center[2]), metersPerUnit};
  std::vector<Vec3i> active(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3d v = (space.localFromWorld(points.positions[i]) - latticeOrigin) / edge - 0.5;
    const Vec3d rounded = glm::round(v);
    if (!(rounded.x >= 0 && rounded.y >= 0 && rounded.z >= 0 && rounded.x < 8.0 * brickCount.x &&
          rounded.y < 8.0 * brickCount.y && rounded.z < 8.0 * brickCount.z))
      throw InputError(path.string(),
                       "the light cache has a light voxel outside its lattice; trace it again");
    active[static_cast<std::size_t>((*order)[i])] = Vec3i(rounded);
  }
  field.lattice = transport::SupportLattice(latticeOrigin, edge, brickCount, active);
  return field;
}

}  // namespace photosphere::estimators
