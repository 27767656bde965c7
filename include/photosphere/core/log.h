#pragma once
// Messages to standard error. Results go to standard output, never through here.

#include <fmt/format.h>

#include <string>
#include <utility>

namespace photosphere::log {

enum class Level { debug, info, warning, error, off };

void setLevel(Level level);
Level level();
/// Text with control characters other than line breaks, tabs and delete as \xNN or \u00NN: names
/// come from files, and must not steer a terminal. JSON stays what it is.
std::string printable(const std::string& text);
/// Writes a message, printable.
void write(Level level, const std::string& text);

template <class... Args>
void debug(fmt::format_string<Args...> format, Args&&... args) {
  if (level() <= Level::debug)
    write(Level::debug, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void info(fmt::format_string<Args...> format, Args&&... args) {
  if (level() <= Level::info) write(Level::info, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void warning(fmt::format_string<Args...> format, Args&&... args) {
  write(Level::warning, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void error(fmt::format_string<Args...> format, Args&&... args) {
  write(Level::error, fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace photosphere::log
