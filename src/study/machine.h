#pragma once
// What studies share: the machine's name, the folder of their runs.

#include <filesystem>
#include <string>

namespace photosphere::study {

/// Processor and system.
std::string machineName();

/// A folder that disappears with the object, however the study ends.
class RunFolder {
 public:
  /// @throws OutputError
  explicit RunFolder(std::filesystem::path path);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;
  const std::filesystem::path& path() const { return m_path; }

 private:
  std::filesystem::path m_path;
};

}  // namespace photosphere::study
