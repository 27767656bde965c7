#pragma once
// What light caches and shards say about themselves as grid metadata, and where their points lie.

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "photosphere/core/error.h"
#include "photosphere/estimators/layout_names.h"
#include "photosphere/estimators/light_cache.h"
#include "photosphere/volume/particle_set.h"

namespace photosphere::estimators {

using Metadata = std::map<std::string, std::string>;

/// Numbers as text that reads back to the same bits.
std::string exact(double v);
std::string exact(const Vec3d& v);

/// Reads metadata entries, each by its type, with errors that name the file.
class MetadataReader {
 public:
  MetadataReader(std::string path, Metadata metadata)
      : m_path(std::move(path)), m_metadata(std::move(metadata)) {}

  const std::string& path() const { return m_path; }
  bool has(const std::string& key) const { return m_metadata.count(key) != 0; }
  const std::string& text(const std::string& key) const;
  double number(const std::string& key) const { return numbers(key, 1)[0]; }
  std::vector<double> numbers(const std::string& key, std::size_t count) const;
  Vec3d vector(const std::string& key) const;
  int whole(const std::string& key, int low, int high) const;
  std::uint64_t count(const std::string& key) const;
  template <class E>
  E choice(const std::string& key) const {
    if (const std::optional<E> value = named<E>(text(key))) return *value;
    bad(key);
  }
  [[noreturn]] void bad(const std::string& key) const;

 private:
  std::string m_path;
  Metadata m_metadata;
};

/// The layout, and what `key` says.
void describeLayout(const LightFieldLayout& layout, const LightCacheKey& key, Metadata& m);
LightFieldLayout readLayout(const MetadataReader& m);
LightCacheKey readKey(const MetadataReader& m);

/// Placement of a lattice.
void describeLattice(const transport::SupportLattice& lattice, Metadata& m);
/// The lattice whose voxels are centred at the points.
/// @param order  number of each point's voxel
transport::SupportLattice readLattice(const MetadataReader& m, const volume::ParticleSet& points,
                                      const std::vector<std::int32_t>& order);

/// World-space points at the voxels of a lattice, with the carriers' own numbering, which files
/// keep as `light_order`.
volume::ParticleSet pointsOf(const transport::SupportLattice& lattice, const LightCacheKey& key);
/// The same of particles, with the positions that the tracer used, to the bit, as `light_local`.
volume::ParticleSet pointsOf(const std::vector<Vec3f>& particles, const LightCacheKey& key);
/// Numbers of the points. @throws InputError unless they are a permutation
const std::vector<std::int32_t>& readOrder(const std::string& path,
                                           const volume::ParticleSet& points);
/// @throws InputError
std::vector<Vec3f> readLocal(const std::string& path, const volume::ParticleSet& points,
                             const std::vector<std::int32_t>& order);

/// What light of voxels counts by, LightField::weights. @throws InputError unless finite and not
/// below zero
std::shared_ptr<const std::vector<float>> readWeights(const std::string& path,
                                                      const volume::ParticleSet& points,
                                                      const std::vector<std::int32_t>& order);
inline constexpr const char* kWeightsName = "photon_weight";

/// What the points of a light cache or shard say; nullptr = not in the file.
struct Contents {
  const transport::SupportLattice* lattice;
  const std::vector<Vec3f>* particles;
  const std::vector<float>* weights;
  std::span<const std::byte> values;
};
/// Checksum of metadata, but of format and version, and of contents.
std::string checksumOf(Metadata metadata, const Contents& contents);
/// What `photosphere_format` holds.
std::string sealed(const char* format, const std::string& checksum);
/// @throws InputError where it is another format
void checkFormat(const MetadataReader& m, const char* format);
/// Holds what was read against the checksum that was written. Files from before there was one have
/// none. @throws InputError where they differ
void checkSeal(const MetadataReader& m, const char* format, const std::string& checksum);

/// A column of that type and size. @throws InputError
template <class T>
const std::vector<T>& column(const std::string& path, const volume::ParticleSet& points,
                             const std::string& name, std::size_t count);

}  // namespace photosphere::estimators
