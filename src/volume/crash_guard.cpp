#include "crash_guard.h"

#include <signal.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <mutex>
#include <utility>

#include "photosphere/core/error.h"
#include "photosphere/core/exhaustion.h"
#include "photosphere/core/output_file.h"
#include "photosphere/core/resources.h"

namespace photosphere::volume {

namespace {

struct Slot {
  std::atomic<bool> armed{false};
  char file[1024] = {};
};

constexpr std::array<int, 5> kSignals{SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL};
std::array<Slot, 64> slots;
std::array<bool, kSignals.size()> handled{};  // by photosphereOnCrash
std::array<struct sigaction, kSignals.size()> previous;
std::mutex mutex;
int armedCount = 0;
int watchCount = 0;
bool readFailed = false;
char lastRead[1024] = {};  // a file that was read to its end
std::terminate_handler otherwise = nullptr;

// blosc asks for less at a time, and writes to address 0 where it does not get it.
constexpr std::uint64_t kUsedUp = std::uint64_t(16) << 20;

// OpenVDB 10 writes past a buffer where a damaged file states a length below zero
// (bloscFromStream). The C library finds that later, when it frees memory, and aborts.
bool staysArmed(std::size_t signal) {
  return kSignals[signal] == SIGABRT && previous[signal].sa_handler == SIG_DFL &&
         (watchCount > 0 || readFailed);
}

void restoreHandlers() {
  if (armedCount > 0) return;
  for (std::size_t i = 0; i < kSignals.size(); ++i)
    if (handled[i] && !staysArmed(i)) {
      sigaction(kSignals[i], &previous[i], nullptr);
      handled[i] = false;
    }
}

// What follows is async-signal-safe: system calls and removeTemporaries only.

// Returns where no file is being read.
void endIfReading() {
  const bool usedUp = freeAddresses() < kUsedUp;
  bool reading = false;
  for (const Slot& slot : slots) {
    if (!slot.armed.load(std::memory_order_relaxed)) continue;
    reading = true;
    printRaw("photosphere: ");
    printRaw(slot.file);
    printRaw(": ");
    printRaw(usedUp ? kRanOutReading
                    : "the OpenVDB library crashed while reading it: the file is damaged; write or "
                      "copy it again");
    printRaw("\n");
  }
  if (!reading) return;
  removeTemporaries();
  _exit(static_cast<int>(usedUp ? ExitCode::memory : ExitCode::inputInvalid));
}

bool sentByAnother(const siginfo_t& info) {
  return info.si_code <= 0 && info.si_pid != getpid();
}

extern "C" void photosphereOnCrash(int number, siginfo_t* info, void*) {
  if (sentByAnother(*info)) {
    removeTemporaries();
    signal(number, SIG_DFL);
    raise(number);  // comes when this handler has returned
    return;
  }
  endIfReading();
  printRaw("photosphere: ");
  printRaw(lastRead);
  printRaw(
      ": the memory was found damaged after this file, or one before it, was read. The OpenVDB "
      "library does that with a damaged file: write or copy it again\n");
  removeTemporaries();
  _exit(static_cast<int>(ExitCode::inputInvalid));
}

// A file may ask for memory where its library cannot say that there is none; for threads none does.
[[noreturn]] void onTerminate() {
  if (exhausted() != Resource::threads) endIfReading();
  if (otherwise) otherwise();
  std::abort();
}

}  // namespace

CrashGuard::CrashGuard(const std::filesystem::path& file)
    : m_exceptions(std::uncaught_exceptions()), m_stack(1 << 16) {
  const std::lock_guard<std::mutex> lock(mutex);
  for (std::size_t i = 0; i < slots.size() && m_slot < 0; ++i)
    if (!slots[i].armed) m_slot = static_cast<int>(i);
  if (m_slot < 0) return;  // 64 files at once: the message will name the others
  Slot& slot = slots[static_cast<std::size_t>(m_slot)];
  std::strncpy(slot.file, file.c_str(), sizeof(slot.file) - 1);
  slot.armed = true;

  stack_t stack{};
  stack_t current{};
  sigaltstack(nullptr, &current);
  if (current.ss_flags & SS_DISABLE) {
    stack.ss_sp = m_stack.data();
    stack.ss_size = m_stack.size();
    sigaltstack(&stack, nullptr);
  } else {
    m_stack.clear();  // this thread has one: a guard further out, or a sanitizer's
  }
  if (armedCount++ > 0) return;
  // Once: a handler set later may end with this one, which must not begin anew with that.
  static bool watching = false;
  if (!std::exchange(watching, true)) otherwise = std::set_terminate(onTerminate);
  struct sigaction action {};
  action.sa_sigaction = photosphereOnCrash;
  action.sa_flags = SA_ONSTACK | SA_SIGINFO;
  sigfillset(&action.sa_mask);
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    struct sigaction before {};
    sigaction(kSignals[i], &action, &before);
    // Left in place by an earlier guard.
    if (before.sa_sigaction != photosphereOnCrash) previous[i] = before;
    handled[i] = true;
  }
}

CrashGuard::~CrashGuard() {
  if (m_slot < 0) return;
  const std::lock_guard<std::mutex> lock(mutex);
  std::strncpy(lastRead, slots[static_cast<std::size_t>(m_slot)].file, sizeof(lastRead) - 1);
  --armedCount;
  readFailed = readFailed || std::uncaught_exceptions() > m_exceptions;
  restoreHandlers();
  if (!m_stack.empty()) {
    stack_t off{};
    off.ss_flags = SS_DISABLE;
    sigaltstack(&off, nullptr);
  }
  slots[static_cast<std::size_t>(m_slot)].armed = false;
}

HeapWatch::HeapWatch() {
  const std::lock_guard<std::mutex> lock(mutex);
  ++watchCount;
}

HeapWatch::~HeapWatch() {
  const std::lock_guard<std::mutex> lock(mutex);
  --watchCount;
  restoreHandlers();
}

}  // namespace photosphere::volume
