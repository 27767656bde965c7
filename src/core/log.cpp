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

void write(Level level, const std::string& message) {
  if (level < g_level) return;
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
