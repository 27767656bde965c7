#include "address_room.h"

#include <sys/resource.h>

#include <algorithm>
#include <mutex>

#include "photosphere/core/resources.h"

namespace photosphere::volume {

namespace {

constexpr std::uint64_t kSanitizer = std::uint64_t(1) << 40;

std::mutex g_mutex;
int g_living = 0;
bool g_limited = false;
struct rlimit g_before {};

}  // namespace

AddressRoom::AddressRoom(std::uint64_t bytes) {
  const std::lock_guard<std::mutex> lock(g_mutex);
  if (g_living++ > 0) {
    struct rlimit now {};
    if (!g_limited || getrlimit(RLIMIT_AS, &now) != 0) return;
    now.rlim_cur = std::min(now.rlim_cur + bytes, g_before.rlim_cur);
    setrlimit(RLIMIT_AS, &now);
    return;
  }
  const std::uint64_t reserved = reservedAddresses();
  g_limited = reserved > 0 && reserved < kSanitizer && getrlimit(RLIMIT_AS, &g_before) == 0;
  if (!g_limited) return;
  struct rlimit limit = g_before;
  limit.rlim_cur = std::min<rlim_t>(reserved + bytes, g_before.rlim_cur);
  g_limited = setrlimit(RLIMIT_AS, &limit) == 0;
}

AddressRoom::~AddressRoom() {
  const std::lock_guard<std::mutex> lock(g_mutex);
  if (--g_living == 0 && g_limited) setrlimit(RLIMIT_AS, &g_before);
}

}  // namespace photosphere::volume
