// Who is blamed for what ends the process: a file while it is read and until what it was read into
// is freed, and nothing else.
#include "crash_guard.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <stdexcept>
#include <system_error>

#include "photosphere/core/error.h"
#include "photosphere/core/exhaustion.h"
#include "photosphere/volume/vdb_file.h"
#include "support/support.h"

namespace photosphere::volume {
namespace {

const ::testing::ExitedWithCode invalid(static_cast<int>(ExitCode::inputInvalid));
const ::testing::ExitedWithCode noMemory(static_cast<int>(ExitCode::memory));
const ::testing::KilledBySignal aborted(SIGABRT);

template <class Exception>
void throwWhereNothingMay(const Exception& error) noexcept {
  std::rethrow_exception(std::make_exception_ptr(error));
}

const std::system_error noThread(EAGAIN, std::generic_category());

void waitForAbortFromOutside() {
  const pid_t parent = getpid();
  if (fork() == 0) {
    kill(parent, SIGABRT);
    _exit(0);
  }
  sleep(60);
}

TEST(CrashGuard, NamesTheFileThatIsBeingRead) {
  const CrashGuard guard("f.vdb");
  EXPECT_EXIT(std::abort(), invalid, "f.vdb: the OpenVDB library crashed while reading it");
  EXPECT_EXIT(throwWhereNothingMay(std::runtime_error("odd")), invalid, "f.vdb: the OpenVDB");
  EXPECT_EXIT(throwWhereNothingMay(std::bad_alloc()), invalid, "f.vdb: the OpenVDB");
}

TEST(CrashGuard, BlamesNoFileForThreads) {
  installTerminateHandler();
  const CrashGuard guard("f.vdb");
  EXPECT_EXIT(throwWhereNothingMay(noThread), noMemory, "no more threads can be started");
  // TBB's words.
  EXPECT_EXIT(throwWhereNothingMay(std::runtime_error("pthread_create has failed: ...")), noMemory,
              "no more threads can be started");
}

TEST(CrashGuard, LeavesASignalFromOutsideAlone) {
  const CrashGuard guard("f.vdb");
  EXPECT_EXIT(waitForAbortFromOutside(), aborted, "^$");
}

TEST(CrashGuard, ReadMemoryIsWatchedUntilItIsFreed) {
  const test::TemporaryFolder folder;
  writeVdb(folder / "f.vdb", {denseToGrid("density", Vec3i(1), {1.0f}, Mat4d(1))});
  Grid kept = readVdb(folder / "f.vdb").grids.front();
  EXPECT_EXIT(std::abort(), invalid, "f.vdb: the memory was found damaged after this file");
  EXPECT_EXIT(waitForAbortFromOutside(), aborted, "^$");
  kept = Grid();
  EXPECT_EXIT(std::abort(), aborted, "^$");
}

TEST(CrashGuard, ReadMemoryIsNotBlamedForExceptions) {
  installTerminateHandler();
  auto guard = std::make_unique<CrashGuard>("f.vdb");
  const HeapWatch watch;
  guard.reset();
  EXPECT_EXIT(throwWhereNothingMay(std::bad_alloc()), noMemory, "error: memory ran out");
  EXPECT_EXIT(throwWhereNothingMay(std::runtime_error("odd")), aborted, "odd");
}

TEST(CrashGuard, AReadThatFailedIsRememberedToTheEnd) {
  try {
    const CrashGuard guard("f.vdb");
    throw std::runtime_error("damaged");
  } catch (const std::runtime_error&) {
  }
  EXPECT_EXIT(std::abort(), invalid, "f.vdb: the memory was found damaged after this file");
}

}  // namespace
}  // namespace photosphere::volume
