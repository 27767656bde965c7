#pragma once
// The table of simulation cache formats and the data they exchange.

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "photosphere/core/param.h"
#include "photosphere/volume/grid.h"
#include "photosphere/volume/particle_set.h"

namespace photosphere::caches {

/// Everything that one cache file of one frame holds.
struct CacheContent {
  std::vector<volume::Grid> grids;             ///< without point grids
  std::vector<volume::ParticleSet> particles;  ///< one set per point grid or particle system
  std::vector<std::string> particleNames;      ///< same length as `particles`
  std::map<std::string, std::string> metadata;
  std::vector<std::string> notes;  ///< what the user should know: skipped, widened
};

/// One format: its source file's stem is its name. A nullptr function means "cannot".
struct CacheFormat {
  std::string_view name;
  std::string_view help;
  std::span<const Param> params;
  std::span<const std::string_view> extensions;  ///< with the dot, lower case
  /// True when the first bytes (at most 4096) are of this format; nullptr = by extension only.
  bool (*recognize)(std::string_view head);
  /// @throws InputMissingError, InputError
  CacheContent (*read)(const std::filesystem::path& path, const ParamValues& options);
  /// Writes whole or not at all. @throws OutputError; ConfigError when the content cannot be held
  void (*write)(const std::filesystem::path& path, const CacheContent& content,
                const ParamValues& options);
};

/// Every format (generated).
std::span<const CacheFormat* const> cacheFormats();

/// The format of a file: by content, then by extension.
/// @throws InputMissingError; InputError that names what to export instead for known foreign
/// formats
const CacheFormat& detectFormat(const std::filesystem::path& path);

/// The format that writes this extension. @throws ConfigError listing those that can
const CacheFormat& formatForWriting(const std::filesystem::path& path);

/// detectFormat and read with default options.
CacheContent readCache(const std::filesystem::path& path);

}  // namespace photosphere::caches
