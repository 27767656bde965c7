#pragma once
// Output that appears whole or not at all: a temporary file beside its target, checked, flushed to
// the disk and renamed over the target.

#include <filesystem>
#include <functional>
#include <string>

namespace photosphere {

/// A file being written. Write to `temporaryPath()`, close it, then `commit()`. Destroyed without
/// commit, or ended by a signal, it removes the temporary and leaves the old target as it was.
/// A target that is a device (/dev/full, /dev/stdout) is written in place and never replaced.
class OutputFile {
 public:
  /// Creates missing parent folders.
  /// @throws OutputError when the target is a directory or its folder cannot be written
  explicit OutputFile(const std::filesystem::path& target);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  const std::filesystem::path& target() const { return m_target; }
  const std::filesystem::path& temporaryPath() const { return m_temporary; }
  /// True when the target is a device, which cannot be reopened to be checked.
  bool inPlace() const { return m_temporary == m_target; }

  /// Flushes to the disk and renames. @throws OutputError
  void commit();

 private:
  std::filesystem::path m_target;
  std::filesystem::path m_temporary;
  int m_slot = -1;
  bool m_committed = false;
};

/// Writes a text or binary blob as an OutputFile. @throws OutputError
void writeFile(const std::filesystem::path& target, const std::string& content);

/// Why a write failed and what to do about it, such as "No space left on device; free some, or
/// write elsewhere". @param error  errno; 0 where nothing is known
std::string describeWriteError(int error);

/// Removes every temporary of this process. Async-signal-safe.
void removeTemporaries() noexcept;
/// The same for good, before the process ends: output that begins from now on waits forever.
/// Async-signal-safe; takes 50 ms.
void endOutputs() noexcept;

}  // namespace photosphere
