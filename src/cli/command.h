#pragma once
// The table of subcommands.

#include <functional>
#include <span>
#include <string_view>

namespace CLI {
class App;
}

namespace photosphere::cli {

/// One subcommand: its source's stem is its name.
struct Command {
  std::string_view name;
  std::string_view help;
  /// Declares its options. What it returns runs the command once they are parsed, and gives the
  /// exit code. @throws Error, in that run
  std::function<int()> (*declare)(CLI::App& app);
};

/// Every subcommand (generated).
std::span<const Command* const> commands();

}  // namespace photosphere::cli
