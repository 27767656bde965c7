// OpenVDB files, through module `volume`.

#include <fmt/format.h>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "photosphere/volume/vdb_file.h"

namespace photosphere::caches::plugins {
namespace {

using namespace std::string_view_literals;

/// OPENVDB_MAGIC as a 64-bit little-endian number.
bool recognize(std::string_view head) {
  return head.starts_with("\x20\x42\x44\x56\0\0\0\0"sv);
}

CacheContent read(const std::filesystem::path& path, const ParamValues&) {
  volume::VdbFile file = volume::readVdb(path);
  CacheContent content;
  content.metadata = std::move(file.metadata);
  for (volume::Grid& grid : file.grids) {
    if (grid.kind() == volume::GridKind::points) {
      content.particleNames.push_back(grid.name());
      content.particles.push_back(volume::gridToPoints(grid));
      continue;
    }
    if (grid.kind() == volume::GridKind::other)
      content.notes.push_back(fmt::format("grid '{}' of type {} is kept, but cannot be rendered",
                                          grid.name(), grid.valueType()));
    content.grids.push_back(std::move(grid));
  }
  return content;
}

void write(const std::filesystem::path& path, const CacheContent& content, const ParamValues&) {
  std::vector<volume::Grid> grids = content.grids;
  for (std::size_t i = 0; i < content.particles.size(); ++i) {
    const bool named = i < content.particleNames.size() && !content.particleNames[i].empty();
    const std::string name = named ? content.particleNames[i] : "points";
    grids.push_back(volume::pointsToGrid(content.particles[i], name, 0));
  }
  if (grids.empty()) throw ConfigError(path.string() + ": there is nothing to write");
  volume::writeVdb(path, grids, content.metadata);
}

constexpr std::string_view kExtensions[] = {".vdb"};

}  // namespace

extern const CacheFormat vdb;
const CacheFormat vdb = {"vdb", "OpenVDB grids and points", {}, kExtensions, recognize, read,
                         write};

}  // namespace photosphere::caches::plugins
