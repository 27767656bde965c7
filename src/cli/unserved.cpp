#include "unserved.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "photosphere/core/error.h"

namespace photosphere::cli {

std::function<int()> declareUnserved(CLI::App& app, std::string_view name,
                                     std::string_view remedy) {
  app.allow_extras();
  return [name, remedy]() -> int {
    throw ConfigError(fmt::format("{} is not served by this version yet; {}", name, remedy));
  };
}

}  // namespace photosphere::cli
