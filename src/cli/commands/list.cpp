// photosphere list: every plug-in and its options.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <memory>

#include "command.h"
#include "photosphere/caches/cache_format.h"
#include "photosphere/cameras/camera.h"
#include "photosphere/core/error.h"
#include "photosphere/lights/light.h"
#include "photosphere/phase/phase.h"
#include "print.h"

namespace photosphere::cli::plugins {

namespace {

template <class Plugin>
std::string listTable(std::span<const Plugin* const> table) {
  std::string text;
  for (const Plugin* plugin : table)
    text +=
        fmt::format("  {}: {}\n{}", plugin->name, plugin->help, formatParams(plugin->params, 6));
  return text;
}

std::string listFormats() {
  std::string text;
  for (const caches::CacheFormat* format : caches::cacheFormats())
    text += fmt::format("  {}: {} ({}; {})\n{}", format->name, format->help,
                        fmt::join(format->extensions, " "),
                        !format->write  ? "read"
                        : !format->read ? "written"
                                        : "read and written",
                        formatParams(format->params, 6));
  return text;
}

std::string listPhases() {
  return listTable(phase::phaseFunctions());
}

std::string listLights() {
  return "  options of every light\n" + formatParams(lights::lightParams(), 6) +
         listTable(lights::lightModels());
}

std::string listCameras() {
  return "  options of every camera\n" + formatParams(cameras::cameraParams(), 6) +
         listTable(cameras::cameraModels());
}

struct Kind {
  std::string_view name;
  std::string (*list)();
};
constexpr std::array kKinds = {
    Kind{"formats", listFormats},
    Kind{"phases", listPhases},
    Kind{"lights", listLights},
    Kind{"cameras", listCameras},
};

int runList(const std::vector<std::string>& wanted) {
  std::vector<std::string_view> names;
  for (const Kind& kind : kKinds)
    names.push_back(kind.name);
  for (const std::string& name : wanted)
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw ConfigError(fmt::format("list: unknown kind '{}'{} (known: {})", name,
                                    suggestion(name, names), fmt::join(names, ", ")));
  for (const Kind& kind : kKinds) {
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), kind.name) == wanted.end())
      continue;
    std::string text = kind.list();
    if (!text.empty()) text.pop_back();
    printLine("{}\n{}", kind.name, text);
  }
  return static_cast<int>(ExitCode::ok);
}

std::function<int()> declareList(CLI::App& app) {
  auto wanted = std::make_shared<std::vector<std::string>>();
  std::string kinds;
  for (const Kind& kind : kKinds)
    kinds += fmt::format("{}{}", kinds.empty() ? "" : ", ", kind.name);
  app.add_option("kinds", *wanted, "Only these: " + kinds)->type_name("KIND");
  return [wanted] { return runList(*wanted); };
}

}  // namespace

extern const Command list;
const Command list = {"list", "Name every plug-in and its options", declareList};

}  // namespace photosphere::cli::plugins
