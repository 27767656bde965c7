#pragma once
// Light caches: a light field as a .vdb that stands alone (layout in CONVENTIONS.md).

#include <filesystem>
#include <string>

#include "photosphere/estimators/light_field.h"

namespace photosphere::estimators {

/// What a light cache belongs to. A cache whose hashes differ from the scene's is stale.
struct LightCacheKey {
  std::string mediumHash;
  std::string lightHash;
  lights::LocalSpace space;
};

/// Writes one point grid named `light`: a point per light voxel (at its centre) or particle, with
/// `photon_histogram` (fluence rate [W m^-2], or power [W], per bin and channel; in its place
/// `photon_harmonics`, the same times Y_lm, per harmonic and channel) and
/// `photon_energy` (its sum over bins), for representative = mean `photon_direction` (the sum of
/// power times direction of every bin), the sets of unscattered light under `..._unscattered`, for
/// Smoothing::visible `photon_weight` (what a voxel's light counts by when voxels are smoothed
/// [1]), and the layout, counts and hashes as grid metadata. Whole or not at all.
/// @throws OutputError; ConfigError for the view basis, which belongs to one camera
void writeLightCache(const std::filesystem::path& path, const LightField& field,
                     const LightCacheKey& key);

/// Reads a light cache back: the same numbers on the same carriers.
/// @throws InputMissingError; InputError when the file is not a light cache, or is stale (it says
///         which hash differs) and `allowStale` is false
LightField readLightCache(const std::filesystem::path& path, const LightCacheKey& expected,
                          bool allowStale);

}  // namespace photosphere::estimators
