#pragma once
// What the process uses and may use: seconds, memory.

#include <chrono>
#include <cstdint>
#include <string>

namespace photosphere {

/// Peak resident memory of this process [bytes].
std::uint64_t peakMemoryBytes();
/// CPU seconds of all threads of this process so far.
double processCpuSeconds();
/// Memory that host, cgroup and the limit of addresses (`ulimit -v`) still leave free [bytes].
std::uint64_t availableMemoryBytes();
/// Addresses that the process has reserved [bytes]; 0 where the system does not tell.
/// Async-signal-safe.
std::uint64_t reservedAddresses();
/// Addresses that the limit which the process was started with leaves it [bytes]; the largest
/// number where there is none. Async-signal-safe.
std::uint64_t freeAddresses();
/// "1.5 GiB".
std::string formatBytes(std::uint64_t bytes);

/// Wall-clock seconds since construction.
class Stopwatch {
 public:
  Stopwatch() : m_start(std::chrono::steady_clock::now()) {}
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - m_start).count();
  }

 private:
  std::chrono::steady_clock::time_point m_start;
};

}  // namespace photosphere
