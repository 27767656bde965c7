#include "photosphere/core/resources.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>

namespace photosphere {

std::uint64_t peakMemoryBytes() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

double processCpuSeconds() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

// Read once: the limit is lowered for a while where a file may take no more than its share.
const std::uint64_t g_addressLimit = [] {
  rlimit limit = {};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kUnlimited;
  return static_cast<std::uint64_t>(limit.rlim_cur);
}();

std::uint64_t readNumber(const char* path, std::uint64_t otherwise) {
  std::ifstream in(path);
  std::uint64_t value = 0;
  return in >> value ? value : otherwise;
}

}  // namespace

std::uint64_t reservedAddresses() {
  const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  char text[32] = {};
  const ssize_t length = read(file, text, sizeof(text) - 1);
  close(file);
  std::uint64_t pages = 0;
  for (const char* c = text; length > 0 && *c >= '0' && *c <= '9'; ++c)
    pages = pages * 10 + static_cast<std::uint64_t>(*c - '0');
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

std::uint64_t freeAddresses() {
  if (g_addressLimit == kUnlimited) return kUnlimited;
  return g_addressLimit - std::min(reservedAddresses(), g_addressLimit);
}

std::uint64_t availableMemoryBytes() {
  std::uint64_t free = freeAddresses();
  std::ifstream meminfo("/proc/meminfo");
  std::string key, unit;
  std::uint64_t kib = 0;
  while (meminfo >> key >> kib && std::getline(meminfo, unit))
    if (key == "MemAvailable:") free = std::min(free, kib * 1024);
  // cgroup v2, then v1; "max" and huge numbers mean no limit.
  const std::uint64_t limit =
      std::min(readNumber("/sys/fs/cgroup/memory.max", kUnlimited),
               readNumber("/sys/fs/cgroup/memory/memory.limit_in_bytes", kUnlimited));
  const std::uint64_t used =
      std::min(readNumber("/sys/fs/cgroup/memory.current", 0) +
                   readNumber("/sys/fs/cgroup/memory/memory.usage_in_bytes", 0),
               limit);
  return std::min(free, limit == kUnlimited ? kUnlimited : limit - used);
}

std::string formatBytes(std::uint64_t bytes) {
  const double b = static_cast<double>(bytes);
  if (b >= 1024.0 * 1024 * 1024) return fmt::format("{:.2f} GiB", b / (1024.0 * 1024 * 1024));
  if (b >= 1024.0 * 1024) return fmt::format("{:.1f} MiB", b / (1024.0 * 1024));
  if (b >= 1024.0) return fmt::format("{:.1f} KiB", b / 1024.0);
  return fmt::format("{} bytes", bytes);
}

}  // namespace photosphere
