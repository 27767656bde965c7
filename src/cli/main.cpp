#include "photosphere/cli/main.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "command.h"
#include "options.h"
#include "photosphere/core/error.h"
#include "photosphere/core/exhaustion.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/log.h"
#include "photosphere/core/output_file.h"
#include "photosphere/core/registry.h"
#include "photosphere/core/version.h"

namespace photosphere::cli {

namespace {

constexpr const char* kExitCodes =
    "Exit codes: 0 ok; 1 unspecified; 2 usage or scene error; 3 input missing; 4 input invalid;\n"
    "5 over the memory budget; 6 output error; 7 comparison target missed; 8 some frames failed;\n"
    "75 interrupted after a checkpoint, run again; 130, 143 ended by a signal.";

/// The parser would only say that a command is missing.
void checkCommandName(int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  const auto names = pluginNames(commands());
  if (std::find(names.begin(), names.end(), std::string_view(argv[1])) == names.end())
    throw ConfigError(fmt::format("unknown command '{}'{} (known: {})", argv[1],
                                  suggestion(argv[1], names), fmt::join(names, ", ")));
}

/// What the shell makes of a variable that is not set is the name of no file, whatever the command.
void refuseEmptyNames(CLI::App& command) {
  for (CLI::Option* option : command.get_options()) {
    const bool input = option->get_positional();
    if (!input && !option->check_lname("output")) continue;
    const std::string reason = fmt::format(
        "an {}'s name is empty; is a variable of the shell not set?", input ? "input" : "output");
    option->check([reason](const std::string& name) { return name.empty() ? reason : ""; }, "");
  }
}

// After `--option=` the parser would take the next argument for the value.
void refuseMissingValues(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--") return;
    if (argument.starts_with("--") && argument.find('=') == argument.size() - 1)
      throw ConfigError(fmt::format(
          "{} has no value after its =; is a variable of the shell not set?", argument));
  }
}

int parseAndRun(int argc, char** argv) {
  checkCommandName(argc, argv);
  refuseMissingValues(argc, argv);
  CLI::App app("Renders light that is scattered many times in smoke.", "photosphere");
  app.set_version_flag("--version", versionText());
  app.require_subcommand(1);
  app.footer(kExitCodes);
  GeneralOptions general;
  std::function<int()> chosen;
  for (const Command* command : commands()) {
    CLI::App* sub = app.add_subcommand(std::string(command->name), std::string(command->help));
    auto body = command->declare(*sub);
    addGeneralOptions(*sub, general);
    refuseEmptyNames(*sub);
    sub->callback([&chosen, body = std::move(body)] { chosen = body; });
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& wanted) {
    return app.exit(wanted);  // help or version
  } catch (const CLI::ParseError& error) {
    throw ConfigError(fmt::format("{} (see photosphere {}--help)", error.what(),
                                  app.get_subcommands().empty()
                                      ? std::string()
                                      : app.get_subcommands().front()->get_name() + " "));
  }
  const auto threads = apply(general);
  return chosen();
}

int report(ExitCode code, const char* why) {
  log::error("{}", why);
  return static_cast<int>(code);
}

/// A stream that was closed before the start (`>&-`) leaves its number to the next file that is
/// opened, and what is printed would go into that. The wrong mode keeps writing to it an error.
void holdStandardStreams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0) open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

// Every exception of a command ends here and becomes its exit code.
int guarded(int argc, char** argv) {
  try {
    return parseAndRun(argc, argv);
  } catch (const InterruptedError& error) {
    removeTemporaries();
    log::error("{}", error.what());
    return 128 + error.signal();
  } catch (const Error& error) {
    return report(error.code(), error.what());
  } catch (const std::exception& error) {
    if (const Resource lacking = exhausted(); lacking != Resource::none)
      return report(ExitCode::memory, remedyFor(lacking));
    return report(ExitCode::unspecified, error.what());
  }
}

}  // namespace

int run(int argc, char** argv) {
  holdStandardStreams();
  installSignalHandlers();
  const int code = guarded(argc, argv);
  // A result that nobody received is no result.
  if ((std::fflush(stdout) != 0 || std::ferror(stdout)) && code == 0)
    return report(ExitCode::output, "standard output: cannot write (disk full, or reader gone?)");
  return code;
}

}  // namespace photosphere::cli
