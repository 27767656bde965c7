#pragma once

namespace photosphere::cli {

/// The whole command line: parses, runs a subcommand, maps errors to exit codes (ExitCode).
int run(int argc, char** argv);

}  // namespace photosphere::cli
