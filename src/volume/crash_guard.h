#pragma once
// What stands between a damaged file and a crash report that names none.

#include <filesystem>
#include <vector>

namespace photosphere::volume {

/// While one lives, SIGSEGV, SIGABRT, SIGBUS, SIGFPE and SIGILL, and exceptions that nothing can
/// catch, print the file's name, remove temporaries and end the process with exit code 4; with 5
/// where the limit of memory that the process was started with is used up. OpenVDB's distribution
/// build keeps its asserts and follows offsets it has read, so a damaged file can raise each of
/// these. Several may live at a time, on any threads; the last one restores the handlers that were
/// there, but for SIGABRT after a read that failed: memory that the library damaged may be found
/// later, and that is said. A signal that another process sends ends this one as it would without.
class CrashGuard {
 public:
  explicit CrashGuard(const std::filesystem::path& file);
  ~CrashGuard();
  CrashGuard(const CrashGuard&) = delete;
  CrashGuard& operator=(const CrashGuard&) = delete;

 private:
  int m_slot = -1;
  int m_exceptions = 0;       // on their way when it was made
  std::vector<char> m_stack;  // the handler's own: the ordinary one may be what overflowed
};

/// While one lives, SIGABRT stays as a CrashGuard left it: what a file was read into still has to
/// be freed, and only then the C library may find that it was written past. Made while a CrashGuard
/// lives.
class HeapWatch {
 public:
  HeapWatch();
  ~HeapWatch();
  HeapWatch(const HeapWatch&) = delete;
  HeapWatch& operator=(const HeapWatch&) = delete;
};

}  // namespace photosphere::volume
