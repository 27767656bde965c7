#include "trial.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <new>

#include "allocation_limit.h"
#include "photosphere/core/error.h"
#include "photosphere/core/resources.h"
#include "support/log_level.h"

namespace photosphere::fuzz {

namespace {

namespace fs = std::filesystem;

/// One process is asked so often before the next begins: memory that one input damaged must not be
/// there for all.
constexpr std::size_t kBatch = 100;

/// Processor time of an input that nothing justifies: each takes milliseconds [s].
constexpr double kHang = test::kSanitized ? 100 : 10;

bool ofTheInput(ExitCode code) {
  return code == ExitCode::usage || code == ExitCode::inputMissing ||
         code == ExitCode::inputInvalid || code == ExitCode::memory;
}

/// @return what is wrong with how the input ended, or nothing
std::string give(const Target& target, const std::string& bytes, const fs::path& folder,
                 Outcomes& outcomes) {
  try {
    target.read(bytes, folder);
    ++outcomes.read;
  } catch (const Error& error) {
    if (!ofTheInput(error.code()) || error.what()[0] == '\0')
      return std::string("an error of another kind: ") + error.what();
    ++outcomes.refused;
  } catch (const std::exception& error) {
    return std::string("no Error: ") + error.what();
  }
  return {};
}

void giveHere(const Target& target, const std::string& bytes, const std::string& what,
              const fs::path& folder, Outcomes& outcomes) {
  // Deflate makes up to 1032 bytes of one, and a reader may hold them twice.
  const AllocationLimit limit(target.room + 2100 * bytes.size());
  const double before = processCpuSeconds();
  const std::string complaint = give(target, bytes, folder, outcomes);
  const double seconds = processCpuSeconds() - before;
  const std::size_t refused = limit.refused();
  if (refused > 0)
    ADD_FAILURE() << what << ": asked for " << refused << " bytes of memory for an input of "
                  << bytes.size();
  if (seconds > kHang)
    ADD_FAILURE() << what << ": " << seconds << " s of processor time for an input of "
                  << bytes.size();
  if (!complaint.empty()) ADD_FAILURE() << what << ": " << complaint;
}

/// What a process of its own leaves behind when it ends early.
struct Shared {
  std::size_t next = 0;  ///< input that it is at
  Outcomes outcomes;
};

constexpr rlim_t kMostMemory = rlim_t(2) << 30;

void limitMemoryAndTime() {
  const struct rlimit memory { kMostMemory, kMostMemory }, cpu{60, 62}, core{0, 0};
  if (!test::kSanitized) setrlimit(RLIMIT_AS, &memory);  // a sanitizer reserves terabytes
  setrlimit(RLIMIT_CPU, &cpu);
  setrlimit(RLIMIT_CORE, &core);
}

/// Memory that a process and those that it began hold [pages].
rlim_t residentPages(pid_t process) {
  const fs::path folder = fs::path("/proc") / std::to_string(process);
  rlim_t all = 0, resident = 0;
  std::ifstream(folder / "statm") >> all >> resident;
  std::ifstream children(folder / "task" / std::to_string(process) / "children");
  for (pid_t child = 0; children >> child;)
    resident += residentPages(child);
  return resident;
}

/// Waits for a process that leads a group. Where no limit keeps the group from taking all the
/// memory of the machine, this does. @return its status
int waitFor(pid_t leader) {
  const rlim_t most = kMostMemory / static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
  int status = 0;
  while (waitpid(leader, &status, test::kSanitized ? WNOHANG : 0) == 0) {
    if (residentPages(leader) > most) kill(-leader, SIGKILL);
    usleep(2000);
  }
  return status;
}

/// Gives inputs from `shared.next` to `end` in a process of its own. @return how that ended
int giveInChild(const Target& target, std::size_t end,
                const std::function<std::string(std::size_t)>& input, const fs::path& folder,
                Shared& shared) {
  const fs::path report = folder / "report";
  const pid_t child = fork();
  if (child < 0) return -1;
  if (child == 0) {
    if (test::kSanitized) setpgid(0, 0);
    limitMemoryAndTime();
    dup2(open(report.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600), STDERR_FILENO);
    for (; shared.next < end; ++shared.next) {
      const std::string complaint = give(target, input(shared.next), folder, shared.outcomes);
      if (complaint.empty()) continue;
      const ssize_t ignored = write(STDERR_FILENO, complaint.data(), complaint.size());
      static_cast<void>(ignored);
      _exit(11);
    }
    _exit(0);
  }
  const int status = waitFor(child);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// Whether a sanitizer reports what the library does by itself: in its headers, in one of the
/// uppermost frames, or in the first that is not of the standard library. Not ours to mend.
bool isOfOpenVdb(int code, const std::string& report) {
  if (code != test::kSanitizerExit) return false;
  const std::size_t error = report.find(": runtime error: ");
  if (error != std::string::npos) {
    const std::size_t line = report.rfind('\n', error) + 1;
    return report.substr(line, error - line).find("/openvdb/") != std::string::npos;
  }
  const auto holds = [](const std::string& line, const char* text) {
    return line.find(text) != std::string::npos;
  };
  bool standard = true;  // so far
  for (int frame = 0; frame < 4 || standard; ++frame) {
    const std::size_t begin = report.find("    #" + std::to_string(frame) + " 0x");
    if (begin == std::string::npos) return false;
    const std::string line = report.substr(begin, report.find('\n', begin) - begin);
    if (holds(line, "openvdb::v") || holds(line, "libopenvdb")) return true;
    standard = standard && (holds(line, " in std::") || holds(line, " in operator new"));
  }
  return false;
}

Outcomes giveInChildren(const Target& target, std::size_t count,
                        const std::function<std::string(std::size_t)>& input,
                        const std::function<std::string(std::size_t)>& what,
                        const fs::path& folder) {
  void* memory =
      mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) {
    ADD_FAILURE() << "no memory to share";
    return {};
  }
  Shared& shared = *new (memory) Shared;
  while (shared.next < count) {
    const int code =
        giveInChild(target, std::min(count, shared.next + kBatch), input, folder, shared);
    if (code == 0) continue;
    const std::string report = test::readText(folder / "report");
    if (code == static_cast<int>(ExitCode::inputInvalid) || isOfOpenVdb(code, report))
      ++shared.outcomes.guarded;
    else if (test::kSanitized && (code == 128 + SIGXCPU || code == 128 + SIGKILL))
      ++shared.outcomes.refused;  // it fills memory that the limit, absent here, would have refused
    else
      ADD_FAILURE() << what(shared.next) << ": ended with " << code << '\n' << report;
    ++shared.next;
  }
  const Outcomes outcomes = shared.outcomes;
  munmap(memory, sizeof(Shared));
  return outcomes;
}

}  // namespace

Outcomes attempt(const Target& target, std::size_t count,
                 const std::function<std::string(std::size_t)>& input,
                 const std::function<std::string(std::size_t)>& what) {
  const test::TemporaryFolder folder;
  const test::LogLevel quiet(log::Level::off);
  Outcomes outcomes;
  if (target.isolated)
    outcomes = giveInChildren(target, count, input, what, folder.path());
  else
    for (std::size_t i = 0; i < count; ++i)
      giveHere(target, input(i), what(i), folder.path(), outcomes);
  return outcomes;
}

}  // namespace photosphere::fuzz
