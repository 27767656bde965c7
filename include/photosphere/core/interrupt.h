#pragma once
// Signals. The first SIGINT, SIGTERM or SIGUSR1 raises a flag that loops poll; a second one removes
// temporaries and ends the process with 128 + signal.

namespace photosphere {

/// Installs the handlers; call once, from the command line.
void installSignalHandlers();
/// The signal that asked to stop, or 0.
int pendingSignal();
/// Throws InterruptedError when a signal asked to stop, unless that is put off. Costs nanoseconds.
void throwIfInterrupted();

/// While one lives, throwIfInterrupted does not throw: work goes on to a point where what it has
/// done can be kept. The second signal still ends the process.
class InterruptDelay {
 public:
  InterruptDelay();
  ~InterruptDelay();
  InterruptDelay(const InterruptDelay&) = delete;
  InterruptDelay& operator=(const InterruptDelay&) = delete;
};

/// The same for its own thread alone: for work from which nothing may be thrown.
class InterruptShield {
 public:
  InterruptShield();
  ~InterruptShield();
  InterruptShield(const InterruptShield&) = delete;
  InterruptShield& operator=(const InterruptShield&) = delete;
};

}  // namespace photosphere
