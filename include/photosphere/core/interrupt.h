#pragma once
// Signals. The first SIGINT, SIGTERM or SIGUSR1 raises a flag that loops poll; a second one removes
// temporaries and ends the process with 128 + signal.

namespace photosphere {

/// Installs the handlers; call once, from the command line.
void installSignalHandlers();
/// The signal that asked to stop, or 0.
int pendingSignal();
/// Throws InterruptedError when a signal asked to stop.
void throwIfInterrupted();

}  // namespace photosphere
