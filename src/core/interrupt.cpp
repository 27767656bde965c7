#include "photosphere/core/interrupt.h"

#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <string>

#include "photosphere/core/error.h"
#include "photosphere/core/output_file.h"

namespace photosphere {

namespace {

std::atomic<int> g_signal{0};
std::atomic<int> g_delays{0};
thread_local int t_shields = 0;
static_assert(std::atomic<int>::is_always_lock_free);  // for handlers

void onSignal(int signal) {
  // Two may come at the same time, to two threads.
  if (g_signal.exchange(signal) == 0) return;
  endOutputs();
  _exit(128 + signal);
}

}  // namespace

InterruptedError::InterruptedError(int signal)
    : Error(ExitCode::unspecified, "stopped by signal " + std::to_string(signal)),
      m_signal(signal) {}

void installSignalHandlers() {
  struct sigaction action = {};
  action.sa_handler = onSignal;
  sigemptyset(&action.sa_mask);
  for (const int signal : {SIGINT, SIGTERM, SIGUSR1})
    sigaction(signal, &action, nullptr);
  // A file-size limit must surface as a failed write, not as a death.
  ::signal(SIGXFSZ, SIG_IGN);
  ::signal(SIGPIPE, SIG_IGN);
}

int pendingSignal() {
  return g_signal;
}

void throwIfInterrupted() {
  if (g_signal != 0 && g_delays == 0 && t_shields == 0) throw InterruptedError(g_signal);
}

InterruptDelay::InterruptDelay() {
  ++g_delays;
}

InterruptDelay::~InterruptDelay() {
  --g_delays;
}

InterruptShield::InterruptShield() {
  ++t_shields;
}

InterruptShield::~InterruptShield() {
  --t_shields;
}

}  // namespace photosphere
