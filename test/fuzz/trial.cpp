#include "trial.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "allocation_limit.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"

namespace photosphere::fuzz {

namespace {

/// Deflate makes up to 1032 bytes of one, and a reader may hold them twice; blocks of files are
/// read by the megabyte.
std::size_t justified(std::size_t bytes) {
  return (std::size_t{16} << 20) + 2100 * bytes;
}

bool ofTheInput(ExitCode code) {
  return code == ExitCode::usage || code == ExitCode::inputMissing ||
         code == ExitCode::inputInvalid || code == ExitCode::memory;
}

/// 0 read, 10 refused, 11 anything else, which `complaint` then tells.
int run(const Target& target, const std::string& bytes, const std::filesystem::path& folder,
        std::string& complaint) {
  try {
    target.read(bytes, folder);
    return 0;
  } catch (const Error& error) {
    if (ofTheInput(error.code()) && error.what()[0] != '\0') return 10;
    complaint = std::string("an error of another kind: ") + error.what();
  } catch (const std::exception& error) {
    complaint = std::string("no Error: ") + error.what();
  }
  return 11;
}

void limitMemoryAndTime() {
  const struct rlimit memory { rlim_t(2) << 30, rlim_t(2) << 30 }, cpu{10, 12}, core{0, 0};
  if (!test::kSanitized) setrlimit(RLIMIT_AS, &memory);  // a sanitizer reserves terabytes
  setrlimit(RLIMIT_CPU, &cpu);
  setrlimit(RLIMIT_CORE, &core);
}

Outcome attemptInChild(const Target& target, const std::string& bytes, const std::string& what,
                       const test::TemporaryFolder& folder) {
  const std::filesystem::path report = folder / "report";
  const pid_t child = fork();
  if (child < 0) {
    ADD_FAILURE() << "fork failed";
    return Outcome::failed;
  }
  if (child == 0) {
    limitMemoryAndTime();
    dup2(open(report.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600), STDERR_FILENO);
    std::string complaint;
    const int code = run(target, bytes, folder.path(), complaint);
    const ssize_t ignored = write(STDERR_FILENO, complaint.data(), complaint.size());
    static_cast<void>(ignored);
    _exit(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  if (code == 0) return Outcome::read;
  if (code == 10) return Outcome::refused;
  if (code == static_cast<int>(ExitCode::inputInvalid)) return Outcome::guarded;
  ADD_FAILURE() << what << ": ended with " << code << '\n' << test::readText(report);
  return Outcome::failed;
}

}  // namespace

Outcome attempt(const Target& target, const std::string& bytes, const std::string& what,
                const test::TemporaryFolder& folder) {
  log::setLevel(log::Level::off);
  if (target.isolated) return attemptInChild(target, bytes, what, folder);
  std::string complaint;
  const AllocationLimit limit(justified(bytes.size()));
  const int code = run(target, bytes, folder.path(), complaint);
  const std::size_t refused = limit.refused();
  if (refused > 0)
    ADD_FAILURE() << what << ": asked for " << refused << " bytes of memory for an input of "
                  << bytes.size();
  if (code == 11) ADD_FAILURE() << what << ": " << complaint;
  return code == 0 ? Outcome::read : code == 10 ? Outcome::refused : Outcome::failed;
}

}  // namespace photosphere::fuzz
