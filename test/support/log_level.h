#pragma once
// Messages of another level than usual, for a while.

#include "photosphere/core/log.h"

namespace photosphere::test {

class LogLevel {
 public:
  explicit LogLevel(log::Level level) { log::setLevel(level); }
  ~LogLevel() { log::setLevel(m_before); }
  LogLevel(const LogLevel&) = delete;
  LogLevel& operator=(const LogLevel&) = delete;

 private:
  const log::Level m_before = log::level();
};

}  // namespace photosphere::test
