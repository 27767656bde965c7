#include "photosphere/core/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <atomic>

namespace photosphere::log {

namespace {

std::atomic<Level> g_level{Level::info};

spdlog::logger& logger() {
  static const std::shared_ptr<spdlog::logger> instance = [] {
    auto created = spdlog::stderr_color_mt("photosphere");
    created->set_pattern("photosphere: %^%l%$: %v");
    created->set_level(spdlog::level::trace);
    return created;
  }();
  return *instance;
}

}  // namespace

void setLevel(Level level) {
  g_level = level;
}
Level level() {
  return g_level;
}

std::string printable(const std::string& text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const unsigned next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0;
    if (byte < 0x20 && byte != '\n' && byte != '\t') {
      out += fmt::format("\\x{:02x}", byte);
    } else if (byte == 0xc2 && next >= 0x80 && next < 0xa0) {
      // The same beyond ASCII, in a form that JSON has, too.
      out += fmt::format("\\u{:04x}", next);
      ++i;
    } else {
      out += text[i];
    }
  }
  return out;
}

void write(Level level, const std::string& text) {
  if (level < g_level) return;
  const std::string message = printable(text);
  switch (level) {
    case Level::debug:
      logger().debug(message);
      break;
    case Level::info:
      logger().info(message);
      break;
    case Level::warning:
      logger().warn(message);
      break;
    default:
      logger().error(message);
      break;
  }
}

}  // namespace photosphere::log
