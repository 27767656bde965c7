#include "crash_guard.h"

#include <signal.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <mutex>

#include "photosphere/core/error.h"
#include "photosphere/core/output_file.h"

namespace photosphere::volume {

namespace {

struct Slot {
  std::atomic<bool> armed{false};
  char file[1024] = {};
};

constexpr std::array<int, 5> kSignals{SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL};
std::array<Slot, 64> slots;
std::array<struct sigaction, kSignals.size()> previous;
std::mutex mutex;
int armedCount = 0;
char lastRead[1024] = {};  // a file that was read to its end

// OpenVDB 10 writes past a buffer where a damaged file states a length below zero
// (bloscFromStream). The C library finds that later, when it frees memory, and aborts.
bool staysArmed(std::size_t signal) {
  return kSignals[signal] == SIGABRT && previous[signal].sa_handler == SIG_DFL;
}

void print(const char* text) {
  const ssize_t ignored = write(STDERR_FILENO, text, std::strlen(text));
  static_cast<void>(ignored);
}

// Async-signal-safe: write, removeTemporaries and _exit only.
extern "C" void photosphereOnCrash(int) {
  bool reading = false;
  for (const Slot& slot : slots) {
    if (!slot.armed.load(std::memory_order_relaxed)) continue;
    reading = true;
    print("photosphere: ");
    print(slot.file);
    print(
        ": the OpenVDB library crashed while reading it: the file is damaged; write or copy it "
        "again\n");
  }
  if (!reading) {
    print("photosphere: ");
    print(lastRead);
    print(
        ": the memory was found damaged after this file, or one before it, was read. The OpenVDB "
        "library does that with a damaged file: write or copy it again\n");
  }
  removeTemporaries();
  _exit(static_cast<int>(ExitCode::inputInvalid));
}

}  // namespace

CrashGuard::CrashGuard(const std::filesystem::path& file) : m_stack(1 << 16) {
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
  struct sigaction action {};
  action.sa_handler = photosphereOnCrash;
  action.sa_flags = SA_ONSTACK;
  sigfillset(&action.sa_mask);
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    struct sigaction before {};
    sigaction(kSignals[i], &action, &before);
    // Left in place by an earlier guard.
    if (before.sa_handler != photosphereOnCrash) previous[i] = before;
  }
}

CrashGuard::~CrashGuard() {
  if (m_slot < 0) return;
  const std::lock_guard<std::mutex> lock(mutex);
  std::strncpy(lastRead, slots[static_cast<std::size_t>(m_slot)].file, sizeof(lastRead) - 1);
  if (--armedCount == 0)
    for (std::size_t i = 0; i < kSignals.size(); ++i)
      if (!staysArmed(i)) sigaction(kSignals[i], &previous[i], nullptr);
  if (!m_stack.empty()) {
    stack_t off{};
    off.ss_flags = SS_DISABLE;
    sigaltstack(&off, nullptr);
  }
  slots[static_cast<std::size_t>(m_slot)].armed = false;
}

}  // namespace photosphere::volume
