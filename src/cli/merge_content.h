#pragma once
// Puts the files of one frame together.

#include <string>
#include <vector>

#include "photosphere/caches/cache_format.h"

namespace photosphere::cli {

/// One particle set of several: attributes that a set lacks are zero or empty there, numbers of
/// different types become double. Empties `sets`.
/// @throws ConfigError when an attribute is text in one set and numbers in another
volume::ParticleSet mergeParticles(std::vector<volume::ParticleSet>& sets);

/// Adds the content of another file of the same frame.
/// @throws ConfigError when both hold a grid of the same name
void mergeContent(caches::CacheContent& content, caches::CacheContent&& other,
                  const std::string& otherPath);

}  // namespace photosphere::cli
