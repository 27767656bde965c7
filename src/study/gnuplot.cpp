#include "gnuplot.h"

#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "photosphere/core/error.h"
#include "photosphere/study/study.h"

extern char** environ;

namespace photosphere::study {

namespace {

struct Pipe {
  std::array<int, 2> ends{-1, -1};
  Pipe() {
    if (pipe(ends.data()) != 0)
      throw Error(ExitCode::unspecified,
                  fmt::format("no pipe to gnuplot: {}", std::strerror(errno)));
  }
  ~Pipe() {
    closeEnd(0);
    closeEnd(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void closeEnd(std::size_t i) {
    if (ends[i] >= 0) close(ends[i]);
    ends[i] = -1;
  }
};

struct Output {
  std::string out, err;
  int status = 0;
};

// Feeds and drains at once, so that neither side waits for the other for ever.
void talk(Pipe& in, Pipe& out, Pipe& err, const std::string& input, Output& result) {
  std::size_t written = 0;
  std::array<char, 65536> buffer{};
  const auto drain = [&](Pipe& pipe, std::string& text) {
    const ssize_t n = read(pipe.ends[0], buffer.data(), buffer.size());
    if (n > 0) text.append(buffer.data(), static_cast<std::size_t>(n));
    if (n == 0 || (n < 0 && errno != EINTR)) pipe.closeEnd(0);
  };
  while (out.ends[0] >= 0 || err.ends[0] >= 0) {
    if (in.ends[1] >= 0 && written == input.size()) in.closeEnd(1);
    std::array<pollfd, 3> wait{
        {{in.ends[1], POLLOUT, 0}, {out.ends[0], POLLIN, 0}, {err.ends[0], POLLIN, 0}}};
    if (poll(wait.data(), wait.size(), -1) < 0) continue;
    if (wait[0].revents) {
      const ssize_t n = write(in.ends[1], input.data() + written,
                              std::min<std::size_t>(4096, input.size() - written));
      if (n > 0) written += static_cast<std::size_t>(n);
      if (n < 0 && errno != EINTR) in.closeEnd(1);
    }
    if (wait[1].revents) drain(out, result.out);
    if (wait[2].revents) drain(err, result.err);
  }
}

Output run(const char* const* arguments, const std::string& input) {
  Pipe in, out, err;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.ends[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out.ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.ends[1], STDERR_FILENO);
  for (const Pipe* pipe : {&in, &out, &err})
    for (const int end : pipe->ends)
      posix_spawn_file_actions_addclose(&actions, end);
  pid_t child = 0;
  const int failed = posix_spawnp(&child, arguments[0], &actions, nullptr,
                                  const_cast<char* const*>(arguments), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed == ENOENT)
    throw ConfigError(
        "gnuplot draws the plots of a study and is not here: apt-get install gnuplot-nox");
  if (failed != 0)
    throw Error(ExitCode::unspecified,
                fmt::format("gnuplot cannot be started: {}", std::strerror(failed)));
  in.closeEnd(0);
  out.closeEnd(1);
  err.closeEnd(1);
  Output result;
  talk(in, out, err, input, result);
  while (waitpid(child, &result.status, 0) < 0 && errno == EINTR) {
  }
  return result;
}

}  // namespace

std::string gnuplotText(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '\'') safe += '\'';
    safe += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
  }
  return safe;
}

std::string runGnuplot(const std::string& script) {
  // -d: no start-up file of the user's changes what the plots show.
  const char* const arguments[] = {"gnuplot", "-d", "-", nullptr};
  Output output = run(arguments, script);
  if (output.status != 0)
    throw Error(ExitCode::unspecified, fmt::format("gnuplot failed: {}", output.err));
  return output.out;
}

std::string gnuplotVersion() {
  const char* const arguments[] = {"gnuplot", "--version", nullptr};
  const Output output = run(arguments, "");
  if (output.status != 0)
    throw ConfigError("gnuplot does not run: " + output.err +
                      " (apt-get install gnuplot-nox gives one that does)");
  return output.out.substr(0, output.out.find('\n'));
}

}  // namespace photosphere::study
