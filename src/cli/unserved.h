#pragma once
// Subcommands of the contract that this version does not serve yet.

#include <functional>
#include <string_view>

namespace CLI {
class App;
}

namespace photosphere::cli {

/// Takes any arguments and refuses them with exit 2.
/// @param name    of the subcommand
/// @param remedy  what to do instead, as the end of a sentence
std::function<int()> declareUnserved(CLI::App& app, std::string_view name, std::string_view remedy);

}  // namespace photosphere::cli
