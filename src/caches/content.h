#pragma once
// Checks that every writer of particles makes before it writes.

#include <filesystem>
#include <vector>

#include "photosphere/caches/cache_format.h"

namespace photosphere::caches {

/// What a particle format can take of a content. Refers to it, copies nothing.
struct WritableParticles {
  const volume::ParticleSet& set;
  std::vector<const volume::Attribute*> attributes;
};

/// The one particle set of the content. Grids beside it and attributes that the format cannot hold
/// (`textColumns` false: text) are left out with a warning.
/// @throws ConfigError when there is none, or several, or an attribute does not cover the particles
WritableParticles onlyParticles(const std::filesystem::path& path, const CacheContent& content,
                                std::string_view format, bool textColumns);

}  // namespace photosphere::caches
