// photosphere list: every plug-in and its options.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <memory>

#include "command.h"
#include "photosphere/core/error.h"
#include "photosphere/core/param.h"
#include "plugin_text.h"
#include "print.h"

namespace photosphere::cli::plugins {

namespace {

struct Kind {
  std::string_view name;
  std::string (*describe)();
};
constexpr std::array kKinds = {
    Kind{"formats", describeFormats},       Kind{"phases", describePhases},
    Kind{"lights", describeLights},         Kind{"cameras", describeCameras},
    Kind{"estimators", describeEstimators}, Kind{"scene", describeScene},
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
    std::string text = kind.describe();
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
  app.add_option("KIND", *wanted, "Only these: " + kinds)->type_name("");
  return [wanted] { return runList(*wanted); };
}

}  // namespace

extern const Command list;
const Command list = {"list", "Name every plug-in and its options", declareList};

}  // namespace photosphere::cli::plugins
