#pragma once
// Checks that every writer of particles makes before it writes.

#include <filesystem>

#include "photosphere/caches/cache_format.h"

namespace photosphere::caches {

/// The one particle set of the content. Grids beside it and attributes that the format cannot hold
/// (`textColumns` false: text) are left out with a warning.
/// @throws ConfigError when there is none, or several, or an attribute does not cover the particles
volume::ParticleSet onlyParticles(const std::filesystem::path& path, const CacheContent& content,
                                  std::string_view format, bool textColumns);

}  // namespace photosphere::caches
