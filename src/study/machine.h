#pragma once
// What studies share: the facts of a run, the folder of its files.

#include <filesystem>

#include "photosphere/study/result.h"
#include "photosphere/study/study.h"

namespace photosphere::study {

/// Fills version, processor and system, date, threads and size of a run.
void describeRun(const StudyOptions& options, RunFacts& facts);

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
