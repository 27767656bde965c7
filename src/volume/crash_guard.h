#pragma once
// What stands between a damaged file and a crash report that names none.

#include <filesystem>
#include <vector>

namespace photosphere::volume {

/// While one lives, SIGSEGV, SIGABRT, SIGBUS, SIGFPE and SIGILL print the file's name, remove
/// temporaries and end the process with exit code 4. OpenVDB's distribution build keeps its asserts
/// and follows offsets it has read, so a damaged file can raise each of these. Several may live at
/// a time, on any threads; the last one restores the handlers that were there, but for SIGABRT
/// where nobody handled it: memory that the library damaged is found later, and that is said.
class CrashGuard {
 public:
  explicit CrashGuard(const std::filesystem::path& file);
  ~CrashGuard();
  CrashGuard(const CrashGuard&) = delete;
  CrashGuard& operator=(const CrashGuard&) = delete;

 private:
  int m_slot = -1;
  std::vector<char> m_stack;  // the handler's own: the ordinary one may be what overflowed
};

}  // namespace photosphere::volume
