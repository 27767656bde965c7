// Reads a doubtful file where it can do no harm.

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <system_error>
#include <thread>

#include "photosphere/core/error.h"
#include "photosphere/core/exhaustion.h"
#include "photosphere/core/parallel.h"
#include "photosphere/core/resources.h"
#include "photosphere/volume/vdb_file.h"
#include "vdb_walk.h"

namespace photosphere::volume {

namespace {

struct Limits {
  rlim_t memory;
  rlim_t cpuSeconds;
};

Limits limitsFor(std::uint64_t fileSize) {
  return {(rlim_t(4) << 30) + 128 * static_cast<rlim_t>(fileSize), 20 + fileSize / 10'000'000};
}

void setLimit(decltype(RLIMIT_AS) resource, rlim_t value) {
  struct rlimit limit {};
  getrlimit(resource, &limit);
  limit.rlim_cur = std::min(value, limit.rlim_max);
  setrlimit(resource, &limit);
}

// The child's part. Leaves by _exit: the parent's static objects are not its own.
[[noreturn]] void readInChild(const std::filesystem::path& path, const Limits& limits, int pipe) {
  dup2(pipe, STDERR_FILENO);
  const int nothing = open("/dev/null", O_WRONLY);
  if (nothing >= 0) dup2(nothing, STDOUT_FILENO);
  // A sanitizer has reserved terabytes of addresses by now: under any limit nothing would work.
  if (reservedAddresses() < limits.memory) setLimit(RLIMIT_AS, limits.memory);
  setLimit(RLIMIT_CPU, limits.cpuSeconds);
  setLimit(RLIMIT_CORE, 0);
  int code = 0;
  std::string message;
  try {
    const ThreadLimit single(1);  // the worker threads stayed behind in the parent
    const VdbFile file = readVdb(path);
    for (const Grid& grid : file.grids)
      if (grid.kind() == GridKind::points) gridToPoints(grid);
    _exit(0);  // without the destructors: they would only take time
  } catch (const Error& error) {
    message = error.what();
    code = static_cast<int>(error.code());
  } catch (const std::exception& error) {
    message = path.string() + ": " + error.what();
    code =
        static_cast<int>(exhausted() == Resource::none ? ExitCode::inputInvalid : ExitCode::memory);
  }
  const ssize_t ignored = write(pipe, message.data(), message.size());
  static_cast<void>(ignored);
  _exit(code);
}

// The child's messages until it closes the pipe or `deadline` passes.
std::string collect(int pipe, std::chrono::steady_clock::time_point deadline) {
  std::string text;
  fcntl(pipe, F_SETFL, O_NONBLOCK);
  char buffer[4096];
  while (std::chrono::steady_clock::now() < deadline) {
    const ssize_t got = read(pipe, buffer, sizeof(buffer));
    if (got == 0) break;
    if (got > 0 && text.size() < 65536) text.append(buffer, static_cast<std::size_t>(got));
    if (got < 0 && errno != EAGAIN && errno != EINTR) break;
    if (got < 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  while (!text.empty() && text.back() == '\n')
    text.pop_back();
  return text;
}

std::string signalReason(const std::filesystem::path& path, int signal, const Limits& limits) {
  if (signal == SIGXCPU || signal == SIGKILL)
    return fmt::format("{}: reading it did not end within {} seconds: the file is damaged",
                       path.string(), limits.cpuSeconds);
  return fmt::format(
      "{}: the OpenVDB library crashed while reading it (signal {}): the file is "
      "damaged",
      path.string(), signal);
}

}  // namespace

bool probeVdb(const std::filesystem::path& path, std::string& reason) {
  reason.clear();
  Limits limits{};
  try {
    limits = limitsFor(walkVdb(path).fileSize);
  } catch (const Error& error) {
    reason = error.what();
    return false;
  }
  int ends[2];
  if (pipe(ends) != 0) throw Error(ExitCode::unspecified, "cannot open a pipe to probe a file");
  const pid_t child = fork();
  if (child < 0) {
    close(ends[0]);
    close(ends[1]);
    throw Error(ExitCode::unspecified, "cannot start a process to probe a file: " +
                                           std::generic_category().message(errno));
  }
  if (child == 0) {
    close(ends[0]);
    readInChild(path, limits, ends[1]);
  }
  close(ends[1]);
  // Wall-clock seconds: a reader that sleeps uses no CPU.
  const auto deadline = std::chrono::steady_clock::now() +
                        std::chrono::seconds(3 * static_cast<std::int64_t>(limits.cpuSeconds));
  reason = collect(ends[0], deadline);
  close(ends[0]);
  if (std::chrono::steady_clock::now() >= deadline) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    reason.clear();
    return true;
  }
  // What the child may take is bounded by this process's own limit.
  if (WIFEXITED(status) && WEXITSTATUS(status) == static_cast<int>(ExitCode::memory) &&
      freeAddresses() < limits.memory)
    throw MemoryError(path.string() + ": " + kRanOutReading);
  if (WIFSIGNALED(status)) reason = signalReason(path, WTERMSIG(status), limits);
  if (reason.empty()) reason = path.string() + ": cannot be read";
  return false;
}

}  // namespace photosphere::volume
