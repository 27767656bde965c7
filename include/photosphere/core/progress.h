#pragma once
// Progress on standard error, in the form that --progress chose.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

namespace photosphere {

/// bar: one line redrawn, only where standard error is a terminal; json: a line per update;
/// openjd: the `openjd_progress:` lines of Open Job Description.
enum class ProgressStyle { none, bar, json, openjd };

void setProgressStyle(ProgressStyle style);
/// `bar` on a terminal, else `none`.
ProgressStyle defaultProgressStyle();

/// Progress of one stage. `add` may be called from any thread; output is limited to a few lines a
/// second.
class Progress {
 public:
  Progress(std::string stage, std::uint64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void add(std::uint64_t done);

 private:
  void print(std::uint64_t done, bool last);

  std::string m_stage;
  std::uint64_t m_total;
  std::atomic<std::uint64_t> m_done{0};
  std::atomic<std::int64_t> m_nextPrint{0};
  std::chrono::steady_clock::time_point m_start;
  std::mutex m_mutex;
};

}  // namespace photosphere
