#include "cache_metadata.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "photosphere/core/checksums.h"
#include "photosphere/core/hash.h"
#include "photosphere/core/version.h"
#include "photosphere/sphere/spherical_harmonics.h"

namespace photosphere::estimators {

std::string exact(double v) {
  return fmt::format("{}", v);
}
std::string exact(const Vec3d& v) {
  return fmt::format("{} {} {}", v.x, v.y, v.z);
}

const std::string& MetadataReader::text(const std::string& key) const {
  const auto found = m_metadata.find(key);
  if (found == m_metadata.end())
    throw InputError(m_path, fmt::format("is of another version: it lacks the metadata '{}'; trace "
                                         "it again",
                                         key));
  return found->second;
}

std::vector<double> MetadataReader::numbers(const std::string& key, std::size_t count) const {
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

Vec3d MetadataReader::vector(const std::string& key) const {
  const std::vector<double> v = numbers(key, 3);
  return {v[0], v[1], v[2]};
}

int MetadataReader::whole(const std::string& key, int low, int high) const {
  const double v = number(key);
  if (!(v >= low && v <= high) || v != std::floor(v)) bad(key);
  return static_cast<int>(v);
}

std::uint64_t MetadataReader::count(const std::string& key) const {
  const std::string& s = text(key);
  std::uint64_t v = 0;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), v);
  if (error != std::errc() || end != s.data() + s.size()) bad(key);
  return v;
}

void MetadataReader::bad(const std::string& key) const {
  throw InputError(
      m_path, fmt::format("metadata '{}' holds '{}', which no trace writes; trace it again", key,
                          text(key)));
}

std::string checksumOf(Metadata metadata, const Contents& contents) {
  Hasher hash;
  metadata.erase("photosphere_format");
  metadata.erase("photosphere_version");
  for (const auto& [key, value] : metadata) {
    hash.text(key);
    hash.text(value);
  }
  for (std::size_t i = 0; contents.lattice && i < contents.lattice->size(); ++i) {
    const Vec3i voxel = contents.lattice->voxel(i);
    hash.numbers(&voxel.x, 3);
  }
  if (contents.particles)
    for (const Vec3f& particle : *contents.particles)
      hash.numbers(&particle.x, 3);
  if (contents.weights) hash.numbers(contents.weights->data(), contents.weights->size());
  hash.bytes(contents.values.data(), contents.values.size());
  return hash.hex();
}

std::string sealed(const char* format, const std::string& checksum) {
  return fmt::format("{}, checksum {}", format, checksum);
}

void checkFormat(const MetadataReader& m, const char* format) {
  const std::string& found = m.text("photosphere_format");
  if (found != format && !found.starts_with(sealed(format, ""))) m.bad("photosphere_format");
}

void checkSeal(const MetadataReader& m, const char* format, const std::string& checksum) {
  const std::string& found = m.text("photosphere_format");
  if (kChecksums && found != format && found != sealed(format, checksum))
    throw InputError(m.path(),
                     "is damaged: what it holds has another checksum than what was written; trace "
                     "it again");
}

void describeLayout(const LightFieldLayout& l, const LightCacheKey& key, Metadata& m) {
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
  // What photons count by; other ways of smoothing belong to how light is read.
  if (l.smoothing == Smoothing::visible) m["smoothing"] = nameOf(l.smoothing);
  m["channels"] = std::to_string(l.channels);
  m["phases"] = std::to_string(l.phases);
  m["unscattered"] = std::string(1, l.unscattered ? '1' : '0');
  m["light_voxel"] = exact(l.lightVoxel);
  m["radius_m"] = exact(l.radius);
  m["deposit_radius_m"] = exact(l.depositRadius);
  m["medium_hash"] = key.mediumHash;
  m["light_hash"] = key.lightHash;
  m["local_center"] = exact(key.space.center);
  m["meters_per_unit"] = exact(key.space.metersPerUnit);
}

LightFieldLayout readLayout(const MetadataReader& m) {
  LightFieldLayout l;
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
  if (m.has("smoothing")) {
    l.smoothing = m.choice<Smoothing>("smoothing");
    if (l.smoothing != Smoothing::visible) m.bad("smoothing");
  }
  l.channels = m.whole("channels", 1, 3);
  if (l.channels == 2) m.bad("channels");
  l.phases = m.whole("phases", 1, transport::kMaxPhases);
  l.unscattered = m.whole("unscattered", 0, 1) == 1;
  l.lightVoxel = m.number("light_voxel");
  l.radius = m.number("radius_m");
  l.depositRadius = m.number("deposit_radius_m");
  if (!(l.lightVoxel > 0)) m.bad("light_voxel");
  return l;
}

LightCacheKey readKey(const MetadataReader& m) {
  LightCacheKey key;
  key.mediumHash = m.text("medium_hash");
  key.lightHash = m.text("light_hash");
  key.space = {m.vector("local_center"), m.number("meters_per_unit")};
  if (!(key.space.metersPerUnit > 0)) m.bad("meters_per_unit");
  return key;
}

void describeLattice(const transport::SupportLattice& lattice, Metadata& m) {
  m["lattice_origin_m"] = exact(lattice.origin());
  m["lattice_edge_m"] = exact(lattice.edge());
  m["lattice_bricks"] = exact(Vec3d(lattice.bricks()));
}

transport::SupportLattice readLattice(const MetadataReader& m, const volume::ParticleSet& points,
                                      const std::vector<std::int32_t>& order) {
  const Vec3d origin = m.vector("lattice_origin_m"), bricks = m.vector("lattice_bricks");
  const double edge = m.number("lattice_edge_m");
  const lights::LocalSpace space = readKey(m).space;
  for (int a = 0; a < 3; ++a)
    if (!(bricks[a] >= 1 && bricks[a] <= 1e6) || bricks[a] != std::floor(bricks[a]))
      m.bad("lattice_bricks");
  if (!(edge > 0)) m.bad("lattice_edge_m");
  // Their table takes memory for each. Smoke so thin in so large a box is none.
  if (bricks.x * bricks.y * bricks.z > 1e6 + 4096.0 * static_cast<double>(points.size()))
    m.bad("lattice_bricks");
  std::vector<Vec3i> active(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3d v = (space.localFromWorld(points.positions[i]) - origin) / edge - 0.5;
    const Vec3d rounded = glm::round(v);
    if (!(rounded.x >= 0 && rounded.y >= 0 && rounded.z >= 0 && rounded.x < 8.0 * bricks.x &&
          rounded.y < 8.0 * bricks.y && rounded.z < 8.0 * bricks.z))
      throw InputError(m.path(), "has a light voxel outside its lattice; trace it again");
    active[static_cast<std::size_t>(order[i])] = Vec3i(rounded);
  }
  return transport::SupportLattice(origin, edge, Vec3i(bricks), active);
}

namespace {

void addOrder(volume::ParticleSet& points) {
  std::vector<std::int32_t> order(points.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    order[i] = static_cast<std::int32_t>(i);
  points.add({"light_order", 1, std::move(order)});
}

}  // namespace

volume::ParticleSet pointsOf(const transport::SupportLattice& lattice, const LightCacheKey& key) {
  volume::ParticleSet points;
  points.positions.reserve(lattice.size());
  for (std::size_t i = 0; i < lattice.size(); ++i)
    points.positions.push_back(key.space.worldFromLocal(
        lattice.origin() + (Vec3d(lattice.voxel(i)) + 0.5) * lattice.edge()));
  addOrder(points);
  return points;
}

volume::ParticleSet pointsOf(const std::vector<Vec3f>& particles, const LightCacheKey& key) {
  volume::ParticleSet points;
  points.positions.reserve(particles.size());
  std::vector<float> local;
  local.reserve(3 * particles.size());
  for (const Vec3f& p : particles) {
    points.positions.push_back(key.space.worldFromLocal(Vec3d(p)));
    local.insert(local.end(), {p.x, p.y, p.z});
  }
  addOrder(points);
  points.add({"light_local", 3, std::move(local)});
  return points;
}

template <class T>
const std::vector<T>& column(const std::string& path, const volume::ParticleSet& points,
                             const std::string& name, std::size_t count) {
  const volume::Attribute* attribute = points.find(name);
  const auto* data = attribute ? std::get_if<std::vector<T>>(&attribute->data) : nullptr;
  if (!data || data->size() != count)
    throw InputError(path, fmt::format("lacks {} values of '{}'; trace it again", count, name));
  return *data;
}
template const std::vector<float>& column(const std::string&, const volume::ParticleSet&,
                                          const std::string&, std::size_t);
template const std::vector<std::int32_t>& column(const std::string&, const volume::ParticleSet&,
                                                 const std::string&, std::size_t);
template const std::vector<std::int64_t>& column(const std::string&, const volume::ParticleSet&,
                                                 const std::string&, std::size_t);

const std::vector<std::int32_t>& readOrder(const std::string& path,
                                           const volume::ParticleSet& points) {
  const auto& order = column<std::int32_t>(path, points, "light_order", points.size());
  std::vector<std::uint8_t> seen(points.size(), 0);
  for (const std::int32_t i : order) {
    if (i < 0 || static_cast<std::size_t>(i) >= seen.size() || seen[static_cast<std::size_t>(i)])
      throw InputError(path, "numbers its carriers wrongly; trace it again");
    seen[static_cast<std::size_t>(i)] = 1;
  }
  return order;
}

std::shared_ptr<const std::vector<float>> readWeights(const std::string& path,
                                                      const volume::ParticleSet& points,
                                                      const std::vector<std::int32_t>& order) {
  const auto& stored = column<float>(path, points, kWeightsName, points.size());
  auto weights = std::make_shared<std::vector<float>>(stored.size());
  for (std::size_t i = 0; i < stored.size(); ++i) {
    if (!(stored[i] >= 0.0f && stored[i] < kInfinity))
      throw InputError(
          path, fmt::format("has a value of '{}' that is no weight; trace it again", kWeightsName));
    (*weights)[static_cast<std::size_t>(order[i])] = stored[i];
  }
  return weights;
}

std::vector<Vec3f> readLocal(const std::string& path, const volume::ParticleSet& points,
                             const std::vector<std::int32_t>& order) {
  const auto& local = column<float>(path, points, "light_local", points.size() * 3);
  std::vector<Vec3f> particles(points.size());
  for (std::size_t i = 0; i < particles.size(); ++i)
    particles[static_cast<std::size_t>(order[i])] = {local[3 * i], local[3 * i + 1],
                                                     local[3 * i + 2]};
  return particles;
}

}  // namespace photosphere::estimators
