#include "photosphere/estimators/light_shard.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "cache_metadata.h"
#include "photosphere/volume/vdb_file.h"

namespace photosphere::estimators {

using transport::TraceStatistics;

namespace {

constexpr const char* kGridName = "light_shard";
constexpr const char* kParticlesName = "light_particles";
constexpr const char* kFormat = "photosphere light shard 1";

struct Count {
  const char* name;
  std::uint64_t TraceStatistics::*member;
};
constexpr Count kCounts[] = {{"photons_emitted", &TraceStatistics::photons},
                             {"photons_born", &TraceStatistics::born},
                             {"scatterings", &TraceStatistics::scatterings},
                             {"flights", &TraceStatistics::flights},
                             {"capped", &TraceStatistics::capped},
                             {"majorant_violations", &TraceStatistics::majorantViolations}};
struct Power {
  const char* name;
  Vec3d TraceStatistics::*member;
};
constexpr Power kPowers[] = {{"watts_emitted", &TraceStatistics::emitted},
                             {"watts_missed", &TraceStatistics::missed},
                             {"watts_absorbed", &TraceStatistics::absorbed},
                             {"watts_escaped", &TraceStatistics::escaped},
                             {"watts_capped", &TraceStatistics::cappedPower}};

// What every shard of a trace has for itself; the rest of the metadata they have in common.
constexpr const char* kOwn[] = {"shard",       "first_photon", "photon_count",
                                "far_photons", "build",        "photosphere_version"};

Metadata describe(const LightShard& shard) {
  const LightSums& light = shard.light;
  Metadata m;
  describeLayout(light.layout, shard.key, m);
  m["shard"] = std::to_string(shard.number.index);
  m["shards"] = std::to_string(shard.number.count);
  m["photons"] = std::to_string(light.photons);
  m["first_photon"] = std::to_string(light.firstPhoton);
  m["photon_count"] = std::to_string(light.photonCount);
  m["far_photons"] = std::to_string(light.farPhotons);
  m["places"] = std::to_string(light.places());
  m["quantum"] = exact(light.quantum);
  m["random_key"] = shard.randomKey;
  m["build"] = shard.build;
  for (const Count& count : kCounts)
    m[count.name] = std::to_string(shard.statistics.*count.member);
  for (const Power& power : kPowers)
    m[power.name] = exact(shard.statistics.*power.member);
  if (!light.layout.holdsPower()) describeLattice(light.lattice, m);
  return m;
}

std::string checksum(const LightShard& shard, const Metadata& metadata) {
  const LightSums& light = shard.light;
  const bool onParticles = light.layout.carrier == Carrier::particles;
  return checksumOf(metadata, {light.layout.holdsPower() ? nullptr : &light.lattice,
                               onParticles ? &light.particles : nullptr, light.weights.get(),
                               std::as_bytes(std::span(light.sums))});
}

const volume::Grid& pointGrid(const volume::VdbFile& file, const char* name,
                              const std::string& path) {
  const volume::Grid* grid = file.tryFind(name);
  if (!grid || grid->kind() != volume::GridKind::points)
    throw InputError(path, fmt::format("is not a shard: it has no point grid named '{}' (make "
                                       "shards with `photosphere trace SCENE -o SHARD.vdb --shard "
                                       "i/n`)",
                                       name));
  return *grid;
}

void readSums(const MetadataReader& m, const volume::ParticleSet& points,
              const std::vector<std::int32_t>& order, LightSums& light) {
  const auto stride = static_cast<std::size_t>(light.layout.valuesPerCarrier());
  const auto& sums = column<std::int64_t>(m.path(), points, "photon_sums", points.size() * stride);
  light.sums.resize(sums.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    std::copy_n(sums.data() + i * stride, stride,
                light.sums.data() + static_cast<std::size_t>(order[i]) * stride);
}

// Everything but the sums, where they lie and what became of the photons.
LightShard readHead(const MetadataReader& m) {
  LightShard shard;
  shard.key = readKey(m);
  shard.number = {m.count("shard"), m.count("shards")};
  if (shard.number.count < 1 || shard.number.count > kMostShards) m.bad("shards");
  if (shard.number.index < 1 || shard.number.index > shard.number.count) m.bad("shard");
  shard.randomKey = m.text("random_key");
  shard.build = m.text("build");
  LightSums& light = shard.light;
  light.layout = readLayout(m);
  if (light.layout.smoothing == Smoothing::visible && light.layout.holdsPower()) m.bad("smoothing");
  light.quantum = m.number("quantum");
  if (!(light.quantum > 0)) m.bad("quantum");
  light.photons = m.count("photons");
  light.firstPhoton = m.count("first_photon");
  light.photonCount = m.count("photon_count");
  if (photonsOf(shard.number, light.photons) != std::pair(light.firstPhoton, light.photonCount))
    m.bad("photon_count");
  light.farPhotons = m.count("far_photons");
  for (const Count& count : kCounts)
    shard.statistics.*count.member = m.count(count.name);
  for (const Power& power : kPowers)
    shard.statistics.*power.member = m.vector(power.name);
  return shard;
}

std::string shardName(const ShardNumber& number) {
  return fmt::format("{}/{}", number.index, number.count);
}

void addStatistics(TraceStatistics& sum, const TraceStatistics& part) {
  for (const Count& count : kCounts)
    sum.*count.member += part.*count.member;
  for (const Power& power : kPowers)
    sum.*power.member += part.*power.member;
}

}  // namespace

std::pair<std::uint64_t, std::uint64_t> photonsOf(const ShardNumber& shard, std::uint64_t photons) {
  const auto border = [&](std::uint64_t i) {
    return photons / shard.count * i + photons % shard.count * i / shard.count;
  };
  const std::uint64_t first = border(shard.index - 1);
  return {first, border(shard.index) - first};
}

void writeLightShard(const std::filesystem::path& path, const LightShard& shard) {
  const LightSums& light = shard.light;
  const bool voxels = !light.layout.holdsPower();
  volume::ParticleSet points =
      voxels ? pointsOf(light.lattice, shard.key) : pointsOf(light.particles, shard.key);
  points.add({"photon_sums", light.layout.valuesPerCarrier(), light.sums});
  if (light.weights) points.add({kWeightsName, 1, *light.weights});
  points.metadata = describe(shard);
  points.metadata["photosphere_format"] = sealed(kFormat, checksum(shard, points.metadata));
  const double voxelSize = voxels ? light.lattice.edge() / shard.key.space.metersPerUnit : 0.0;
  std::vector<volume::Grid> grids{volume::pointsToGrid(points, kGridName, voxelSize)};
  if (voxels && light.layout.carrier == Carrier::particles)
    grids.push_back(
        volume::pointsToGrid(pointsOf(light.particles, shard.key), kParticlesName, 0.0));
  volume::writeVdb(path, grids);
}

LightShard readLightShard(const std::filesystem::path& path) {
  const volume::VdbFile file = volume::readVdb(path);
  const volume::ParticleSet points =
      volume::gridToPoints(pointGrid(file, kGridName, path.string()));
  const MetadataReader m(path.string(), points.metadata);
  checkFormat(m, kFormat);
  LightShard shard = readHead(m);
  LightSums& light = shard.light;
  if (m.count("places") != points.size()) m.bad("places");
  const std::vector<std::int32_t>& order = readOrder(path.string(), points);
  readSums(m, points, order, light);
  if (light.layout.holdsPower()) {
    light.particles = readLocal(path.string(), points, order);
  } else {
    light.lattice = readLattice(m, points, order);
    if (light.layout.smoothing == Smoothing::visible)
      light.weights = readWeights(path.string(), points, order);
    if (light.layout.carrier == Carrier::particles) {
      const volume::ParticleSet particles =
          volume::gridToPoints(pointGrid(file, kParticlesName, path.string()));
      light.particles = readLocal(path.string(), particles, readOrder(path.string(), particles));
    }
  }
  checkSeal(m, kFormat, checksum(shard, describe(shard)));
  return shard;
}

namespace {

// Sums of shards, which are statistics in the order of their numbers whatever the files' order.
class ShardSum {
 public:
  void add(const std::filesystem::path& path) {
    LightShard shard = readLightShard(path);
    const Metadata m = common(shard);
    const auto [seen, isNew] = m_seen.emplace(shard.number.index, Part{path, shard.statistics});
    if (!m_sum) {
      m_first = path;
      m_common = m;
      m_sum = std::move(shard);
      return;
    }
    for (const auto& [key, value] : m)
      if (value != m_common[key])
        throw InputError(
            path.string(),
            fmt::format("is a shard of another trace than {}: its {} is '{}' and there "
                        "'{}'",
                        m_first.string(), key, value, m_common[key]));
    if (!isNew)
      throw InputError(path.string(),
                       fmt::format("is shard {} a second time, after {}", shardName(shard.number),
                                   seen->second.path.string()));
    if (shard.light.sums.size() != m_sum->light.sums.size() ||
        shard.light.particles != m_sum->light.particles)
      throw InputError(path.string(), fmt::format("is a shard of another trace than {}: its light "
                                                  "lies on other voxels or particles",
                                                  m_first.string()));
    if (shard.build != m_sum->build) m_otherBuilds = true;
    addSums(m_sum->light, shard.light);
  }

  MergedLight finish() {
    const std::uint64_t wanted = m_sum->number.count;
    std::vector<std::string> missing;
    for (std::uint64_t i = 1; i <= wanted && missing.size() < 10; ++i)
      if (m_seen.count(i) == 0) missing.push_back(shardName({i, wanted}));
    if (!missing.empty())
      throw InputError(m_first.string(),
                       fmt::format("is one of {} shards, of which {} are missing: {}; trace these "
                                   "too",
                                   wanted, wanted - m_seen.size(), fmt::join(missing, ", ")));
    MergedLight merged;
    for (const auto& [index, part] : m_seen)
      addStatistics(merged.statistics, part.statistics);
    merged.key = m_sum->key;
    merged.field = toField(std::move(m_sum->light));
    if (m_otherBuilds)
      merged.notes.push_back(
          "the shards were traced by different builds: their sums may differ in the last bits from "
          "those of one build");
    return merged;
  }

 private:
  static Metadata common(const LightShard& shard) {
    Metadata m = describe(shard);
    for (const char* key : kOwn)
      m.erase(key);
    for (const Count& count : kCounts)
      m.erase(count.name);
    for (const Power& power : kPowers)
      m.erase(power.name);
    return m;
  }

  struct Part {
    std::filesystem::path path;
    TraceStatistics statistics;
  };
  std::map<std::uint64_t, Part> m_seen;
  std::filesystem::path m_first;
  Metadata m_common;
  std::optional<LightShard> m_sum;
  bool m_otherBuilds = false;
};

}  // namespace

MergedLight mergeLightShards(const std::vector<std::filesystem::path>& paths) {
  if (paths.empty()) throw ConfigError("no shards to merge");
  ShardSum sum;
  for (const std::filesystem::path& path : paths)
    sum.add(path);
  return sum.finish();
}

}  // namespace photosphere::estimators
