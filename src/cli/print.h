#pragma once
// Results, on standard output.

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

#include "photosphere/core/log.h"
#include "photosphere/core/types.h"

namespace photosphere::cli {

/// Prints one line, at once: whoever reads the pipe sees it when it is true.
template <class... Args>
void printLine(fmt::format_string<Args...> format, Args&&... args) {
  const std::string line = log::printable(fmt::format(format, std::forward<Args>(args)...)) + '\n';
  std::fwrite(line.data(), 1, line.size(), stdout);
  std::fflush(stdout);
}

/// `(1, 2, 3)`.
inline std::string formatVec(const Vec3d& v) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x, v.y, v.z);
}
inline std::string formatBox(const Box3d& box) {
  return box.empty() ? std::string("empty")
                     : fmt::format("{} to {}", formatVec(box.min), formatVec(box.max));
}

}  // namespace photosphere::cli
