#include "options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <charconv>

#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/core/param.h"
#include "photosphere/core/progress.h"

namespace photosphere::cli {

namespace {

struct NamedStyle {
  std::string_view name;
  ProgressStyle style;
};
constexpr std::array kStyles = {
    NamedStyle{"none", ProgressStyle::none}, NamedStyle{"bar", ProgressStyle::bar},
    NamedStyle{"json", ProgressStyle::json}, NamedStyle{"openjd", ProgressStyle::openjd}};

constexpr unsigned kMaxThreads = 4096;

}  // namespace

void addGeneralOptions(CLI::App& app, GeneralOptions& options) {
  const char* group = "General";
  app.add_flag("-v,--verbose", options.verbose, "More messages on standard error")->group(group);
  app.add_flag("-q,--quiet", options.quiet, "Errors only on standard error")->group(group);
  app.add_option("-j,--threads", options.threads,
                 "Threads; 0 = all that the process may use, or SLURM_CPUS_PER_TASK [0]")
      ->type_name("N")
      ->check(CLI::Range(0u, kMaxThreads).description(""))
      ->group(group);
  std::vector<std::string> names;
  for (const NamedStyle& style : kStyles)
    names.emplace_back(style.name);
  app.add_option("--progress", options.progress,
                 "Progress on standard error: none, bar, json, openjd (Open Job Description) "
                 "[bar on a terminal, else none]")
      ->type_name("STYLE")
      ->check(CLI::IsMember(names).description(""))
      ->group(group);
}

std::unique_ptr<ThreadLimit> apply(const GeneralOptions& options) {
  if (options.verbose && options.quiet)
    throw ConfigError("--verbose and --quiet contradict each other; give one");
  if (options.verbose) log::setLevel(log::Level::debug);
  if (options.quiet) log::setLevel(log::Level::error);
  ProgressStyle style = options.quiet ? ProgressStyle::none : defaultProgressStyle();
  for (const NamedStyle& known : kStyles)
    if (known.name == options.progress) style = known.style;
  // A bar redraws its line, which only a terminal understands.
  if (style == ProgressStyle::bar) style = defaultProgressStyle();
  setProgressStyle(style);
  return std::make_unique<ThreadLimit>(options.threads);
}

void addFrameOptions(CLI::App& app, FrameOptions& options) {
  addFrameRange(app, options);
  addOutputFrameOptions(app, options);
}

void addFrameRange(CLI::App& app, FrameOptions& options) {
  const char* group = "Frames";
  app.add_option("--frames", options.frames, "Frames: 7, 1-100, 1-100x2, 1-5y2, 3,4,10-20x2, 5-1")
      ->type_name("RANGE")
      ->group(group);
  app.add_flag("--keep-going", options.keepGoing,
               "After a failed frame go on with the others, then exit 8")
      ->group(group);
}

void addOutputFrameOptions(CLI::App& app, FrameOptions& options) {
  const char* group = "Frames";
  app.add_flag("--skip-existing", options.skipExisting,
               "Leave out frames whose output opens and is complete")
      ->group(group);
  app.add_flag("--dry-run", options.dryRun, "Print what would be done, and do nothing")
      ->group(group);
}

Vec3d parseVec3(std::string_view option, const std::string& text) {
  const Param row{
      .name = option, .type = ParamType::vec3, .unit = "", .defaultText = "", .help = ""};
  const auto numbers = std::get<std::vector<double>>(parseParam(row, text, "command line"));
  return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

std::vector<int> parseInts(std::string_view option, const std::string& text, char separator,
                           std::size_t count, std::string_view form) {
  std::vector<int> values;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  while (true) {
    int value = 0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc()) break;
    values.push_back(value);
    at = next;
    if (at == end || *at != separator) break;
    ++at;
  }
  if (at != end || values.size() != count)
    throw ConfigError(
        fmt::format("command line: {} '{}' is not of the form {}", option, text, form));
  return values;
}

std::pair<std::string, std::string> parseAssignment(std::string_view option,
                                                    const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw ConfigError(
        fmt::format("command line: {} '{}' is not of the form name=value", option, text));
  return {text.substr(0, equals), text.substr(equals + 1)};
}

}  // namespace photosphere::cli
