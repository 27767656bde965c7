#include "photosphere/core/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>

namespace photosphere {

namespace {

std::atomic<ProgressStyle> g_style{ProgressStyle::none};

std::string formatSeconds(double seconds) {
  const auto s = std::lround(seconds);
  if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
  return fmt::format("{}:{:02}", s / 60, s % 60);
}

}  // namespace

void setProgressStyle(ProgressStyle style) {
  g_style = style;
}

ProgressStyle defaultProgressStyle() {
  return isatty(STDERR_FILENO) ? ProgressStyle::bar : ProgressStyle::none;
}

Progress::Progress(std::string stage, std::uint64_t total)
    : m_stage(std::move(stage)),
      m_total(std::max<std::uint64_t>(1, total)),
      m_start(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  const std::uint64_t done = m_done;
  print(done, true);
}

void Progress::add(std::uint64_t done) {
  const std::uint64_t now = m_done.fetch_add(done) + done;
  if (g_style == ProgressStyle::none) return;
  const auto elapsed = std::chrono::duration_cast<std::chrono::milliseconds>(
                           std::chrono::steady_clock::now() - m_start)
                           .count();
  std::int64_t next = m_nextPrint;
  if (elapsed < next || !m_nextPrint.compare_exchange_strong(next, elapsed + 200)) return;
  print(now, false);
}

void Progress::print(std::uint64_t done, bool last) {
  const ProgressStyle style = g_style;
  if (style == ProgressStyle::none) return;
  const std::lock_guard lock(m_mutex);
  const double fraction = std::min(1.0, static_cast<double>(done) / static_cast<double>(m_total));
  const double elapsed =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - m_start).count();
  const double left = fraction > 0 ? elapsed * (1 - fraction) / fraction : 0;
  std::string line;
  if (style == ProgressStyle::bar) {
    const int filled = static_cast<int>(fraction * 30);
    line = fmt::format("\r{:<10} [{:<30}] {:3.0f} %  {} {}  ", m_stage,
                       std::string(static_cast<std::size_t>(filled), '#'), fraction * 100,
                       last ? "took" : "left", formatSeconds(last ? elapsed : left));
    if (last) line += '\n';
  } else if (style == ProgressStyle::json) {
    line = fmt::format(
        "{{\"stage\":\"{}\",\"fraction\":{:.4f},\"seconds\":{:.2f},\"seconds_left\":{:.2f}}}\n",
        m_stage, fraction, elapsed, left);
  } else {
    line = fmt::format("openjd_progress: {:.1f}\nopenjd_status: {}\n", fraction * 100, m_stage);
  }
  std::fputs(line.c_str(), stderr);
  std::fflush(stderr);
}

}  // namespace photosphere
