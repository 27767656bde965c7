#pragma once
// Options that several subcommands share.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "photosphere/core/parallel.h"
#include "photosphere/core/types.h"

namespace CLI {
class App;
}

namespace photosphere::cli {

/// What every command takes: messages, threads, progress.
struct GeneralOptions {
  bool verbose = false;
  bool quiet = false;
  unsigned threads = 0;
  std::string progress;
};

void addGeneralOptions(CLI::App& app, GeneralOptions& options);
/// Sets the level of messages and the style of progress. @return the limit, to be kept alive
std::unique_ptr<ThreadLimit> apply(const GeneralOptions& options);

/// What every command that works frame by frame takes.
struct FrameOptions {
  std::string frames;
  bool skipExisting = false;
  bool keepGoing = false;
  bool dryRun = false;
};

void addFrameOptions(CLI::App& app, FrameOptions& options);
/// Which frames, and what a failed one does: for commands that write none, too.
void addFrameRange(CLI::App& app, FrameOptions& options);
/// The others: what happens to the outputs.
void addOutputFrameOptions(CLI::App& app, FrameOptions& options);

/// Three numbers, as `1,-2,0.5` or `[1, -2, 0.5]`. @throws ConfigError naming the option
Vec3d parseVec3(std::string_view option, const std::string& text);
/// Whole numbers with a separator between them, such as `1280x720`.
/// @throws ConfigError naming the option and its form
std::vector<int> parseInts(std::string_view option, const std::string& text, char separator,
                           std::size_t count, std::string_view form);
/// `name` and `value` of `name=value`. @throws ConfigError naming the option
std::pair<std::string, std::string> parseAssignment(std::string_view option,
                                                    const std::string& text);

}  // namespace photosphere::cli
