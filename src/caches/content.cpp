#include "content.h"

#include <fmt/format.h>

#include <variant>

#include "photosphere/core/error.h"
#include "photosphere/core/log.h"

namespace photosphere::caches {

namespace {

bool isText(const volume::Attribute& attribute) {
  return std::holds_alternative<std::vector<std::string>>(attribute.data);
}

/// Values of the column, not particles: independent of Attribute::size, which divides by arity.
std::size_t valueCount(const volume::Attribute& attribute) {
  return std::visit([](const auto& column) { return column.size(); }, attribute.data);
}

}  // namespace

WritableParticles onlyParticles(const std::filesystem::path& path, const CacheContent& content,
                                std::string_view format, bool textColumns) {
  const std::string name = path.string();
  if (content.particles.empty())
    throw ConfigError(fmt::format("{}: {} holds particles, and there are none to write{}", name,
                                  format, content.grids.empty() ? "" : "; write grids as .vdb"));
  if (content.particles.size() > 1)
    throw ConfigError(fmt::format(
        "{}: {} holds one particle set, not {} ({}); write .vdb, or one set "
        "a file",
        name, format, content.particles.size(), fmt::join(content.particleNames, ", ")));
  if (!content.grids.empty())
    log::warning("{}: {} holds no grids; {} left out (write .vdb to keep them)", name, format,
                 content.grids.size());
  const volume::ParticleSet& set = content.particles.front();
  WritableParticles result{set, {}};
  for (const volume::Attribute& attribute : set.attributes) {
    if (isText(attribute) && (!textColumns || attribute.arity != 1)) {
      log::warning("{}: {} holds no text; attribute '{}' left out", name, format, attribute.name);
      continue;
    }
    if (attribute.arity < 1 ||
        valueCount(attribute) != set.size() * static_cast<std::size_t>(attribute.arity))
      throw ConfigError(fmt::format("{}: attribute '{}' has {} values for {} particles of {}", name,
                                    attribute.name, valueCount(attribute), set.size(),
                                    attribute.arity));
    result.attributes.push_back(&attribute);
  }
  return result;
}

}  // namespace photosphere::caches
