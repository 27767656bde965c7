#include "photosphere/estimators/light_cache.h"

#include <fmt/format.h>

#include <cmath>

#include "cache_metadata.h"
#include "photosphere/volume/vdb_file.h"

namespace photosphere::estimators {

namespace {

constexpr const char* kGridName = "light";
constexpr const char* kFormat = "photosphere light cache 1";

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

Metadata describe(const LightField& field, const LightCacheKey& key) {
  Metadata m;
  describeLayout(field.layout, key, m);
  if (field.layout.carrier == Carrier::voxels) describeLattice(field.lattice, m);
  m["photons"] = std::to_string(field.photons);
  m["far_photons"] = std::to_string(field.farPhotons);
  m["carriers"] = std::to_string(field.carriers());
  return m;
}

std::string checksum(const LightField& field, const Metadata& metadata) {
  const bool voxels = field.layout.carrier == Carrier::voxels;
  return checksumOf(metadata,
                    {voxels ? &field.lattice : nullptr, voxels ? nullptr : &field.particles,
                     field.weights.get(), std::as_bytes(std::span(field.values))});
}

}  // namespace

void writeLightCache(const std::filesystem::path& path, const LightField& field,
                     const LightCacheKey& key) {
  if (field.layout.basis == Basis::view)
    throw ConfigError(
        "a light cache serves every camera, and the view basis belongs to one; set "
        "estimator.basis = \"histogram\", \"spherical_harmonics\" or \"auto\"");
  const bool voxels = field.layout.carrier == Carrier::voxels;
  volume::ParticleSet points =
      voxels ? pointsOf(field.lattice, key) : pointsOf(field.particles, key);
  addSet(points, field, 0, "");
  if (field.layout.unscattered) addSet(points, field, 1, "_unscattered");
  if (field.weights) points.add({kWeightsName, 1, *field.weights});
  points.metadata = describe(field, key);
  points.metadata["photosphere_format"] = sealed(kFormat, checksum(field, points.metadata));
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
                     file.tryFind("light_shard")
                         ? "is one shard of a light cache; sum all of them with `photosphere merge`"
                         : "is not a light cache: it has no point grid named 'light' (make one "
                           "with `photosphere trace SCENE -o LIGHT.vdb`)");
  const volume::ParticleSet points = volume::gridToPoints(*grid);
  const MetadataReader m(path.string(), points.metadata);
  checkFormat(m, kFormat);
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
  l = readLayout(m);
  const bool weighted = l.smoothing == Smoothing::visible;
  if (weighted && l.carrier == Carrier::particles) m.bad("smoothing");  // its lattice is gone
  field.photons = m.count("photons");
  field.farPhotons = m.count("far_photons");
  const std::size_t count = points.size();
  if (m.count("carriers") != count)
    throw InputError(path.string(), "the light cache is not whole; trace it again");
  const std::vector<std::int32_t>& order = readOrder(path.string(), points);

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
    columns.push_back({&column<float>(path.string(), points, name, count * width), width, offset});
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
                  field.values.data() + static_cast<std::size_t>(order[i]) * stride + c.offset);
  if (l.carrier == Carrier::particles)
    field.particles = readLocal(path.string(), points, order);
  else
    field.lattice = readLattice(m, points, order);
  if (weighted) field.weights = readWeights(m.path(), points, order);
  checkSeal(m, kFormat, checksum(field, describe(field, readKey(m))));
  return field;
}

}  // namespace photosphere::estimators
