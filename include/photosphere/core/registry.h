#pragma once
// Look-up in a plug-in table.

#include <fmt/format.h>

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "photosphere/core/error.h"
#include "photosphere/core/param.h"

namespace photosphere {

/// Names of a plug-in table, in its order. Every plug-in has `name`, `help` and `params`.
template <class Plugin>
std::vector<std::string_view> pluginNames(std::span<const Plugin* const> table) {
  std::vector<std::string_view> names;
  for (const Plugin* plugin : table)
    names.push_back(plugin->name);
  return names;
}

/// The plug-in of that name.
/// @throws ConfigError that lists the known names
template <class Plugin>
const Plugin& findPlugin(std::span<const Plugin* const> table, std::string_view name,
                         std::string_view kind, const std::string& where) {
  for (const Plugin* plugin : table)
    if (plugin->name == name) return *plugin;
  const auto names = pluginNames(table);
  throw ConfigError(fmt::format("{}: unknown {} '{}'{} (known: {})", where, kind, name,
                                suggestion(name, names), fmt::join(names, ", ")));
}

}  // namespace photosphere
