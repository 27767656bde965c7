#pragma once
// Shards: parts of the photons of one light cache, traced apart and added up (METHOD.md section 6).

#include <filesystem>
#include <string>
#include <vector>

#include "photosphere/estimators/light_cache.h"
#include "photosphere/estimators/light_sums.h"

namespace photosphere::estimators {

inline constexpr int kMostShards = 1'000'000;

/// Part `index` of `count`, from 1 on.
struct ShardNumber {
  std::uint64_t index = 1, count = 1;
};

/// The photons of that part: consecutive ones, parts differing by one photon at most.
/// @return first and count
std::pair<std::uint64_t, std::uint64_t> photonsOf(const ShardNumber& shard, std::uint64_t photons);

/// What a shard's file holds.
struct LightShard {
  ShardNumber number;
  LightSums light;
  LightCacheKey key;
  std::string randomKey;  ///< that photons were drawn by
  std::string build;      ///< what traced it: sums of other builds differ in last bits
  transport::TraceStatistics statistics;
};

/// Writes one point grid named `light_shard`, a point per light voxel or particle, with
/// `photon_sums` (64-bit integers, in the order of the light cache's values, times `photon_weight`
/// where that is there), and as metadata the quantum, counts and all that must agree between
/// shards; a second grid, `light_particles`, where light is gathered on voxels for particles. Whole
/// or not at all. @throws OutputError
void writeLightShard(const std::filesystem::path& path, const LightShard& shard);

/// @throws InputMissingError; InputError when the file is not a shard
LightShard readLightShard(const std::filesystem::path& path);

/// A light cache's content.
struct MergedLight {
  LightField field;
  LightCacheKey key;
  transport::TraceStatistics statistics;
  std::vector<std::string> notes;
};

/// Adds up shards, one file at a time. The same bits for any order of the files, and as without
/// shards.
/// @throws InputError naming the file for a shard that is there twice, of another trace, or whose
///         fellows are missing
MergedLight mergeLightShards(const std::vector<std::filesystem::path>& paths);

}  // namespace photosphere::estimators
