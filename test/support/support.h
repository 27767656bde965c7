#pragma once
// Helpers that every test program shares.

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "photosphere/core/types.h"

namespace photosphere::test {

/// True in builds that a sanitizer slows down ten times: tests that average over many random paths
/// then run the same code on fewer.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PHOTOSPHERE_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PHOTOSPHERE_SANITIZED 1
#endif
#endif
#if defined(PHOTOSPHERE_SANITIZED)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// While one lives in such a build, expectations that fail are not heard, and `fewer` makes a
/// fiftieth of a number: the code is run for what the sanitizer sees of it, where it would take too
/// long to have a mean to judge. In other builds it does nothing.
class RunOnly {
 public:
  RunOnly();
  ~RunOnly();
  RunOnly(const RunOnly&) = delete;
  RunOnly& operator=(const RunOnly&) = delete;

 private:
  struct Deaf;
  std::unique_ptr<Deaf> m_deaf;
};

/// Of paths, photons, draws: how many are taken; at least one.
std::uint64_t fewer(std::uint64_t count);

/// What a program ends with after the report of a sanitizer (CMakePresets.json, test preset
/// `asan`): none of photosphere's own exit codes.
inline constexpr int kSanitizerExit = 99;

/// A folder of its own that disappears with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return m_path; }
  std::filesystem::path operator/(const std::string& name) const { return m_path / name; }

 private:
  std::filesystem::path m_path;
};

/// A file of the project, by its path below the root.
std::filesystem::path projectFile(const std::string& relative);

/// A file below the folder of caches written by other software. Use through FOREIGN_CACHE, which
/// skips the test, saying so, when the folder is absent.
std::filesystem::path foreignCache(const std::string& relative);

/// A process and what it printed.
struct RunResult {
  int exitCode = -1;  ///< 128 + signal when a signal ended it
  std::string out;
  std::string err;
};
/// Runs the photosphere program with these arguments (no shell). The test fails, whatever exit code
/// it expects, when a sanitizer reports something.
RunResult runTool(const std::vector<std::string>& arguments,
                  const std::filesystem::path& workingFolder = {});
/// Runs a command line through /bin/sh.
RunResult runShell(const std::string& command, const std::filesystem::path& workingFolder = {});

std::string readText(const std::filesystem::path& path);
void writeText(const std::filesystem::path& path, const std::string& content);
/// Puts numbers into a file that no writer lets through, where it holds others as plain floats. The
/// test fails where it holds none.
void replaceFloats(const std::filesystem::path& path, float from, float to);

/// Pearson chi-squared test of a direction sampler against its density, over `8 rows^2`-cell bins
/// of equal area with pooled small cells.
/// @param sample   draws a direction from two uniform numbers
/// @param density  [1/sr]
/// @return p-value; a correct sampler gives values uniform in [0, 1]
double directionChiSquared(const std::function<Vec3f(const Vec2f&)>& sample,
                           const std::function<double(const Vec3f&)>& density, int count,
                           std::uint64_t seed);

/// Upper tail of the chi-squared distribution.
double chiSquaredTail(double statistic, double degreesOfFreedom);

}  // namespace photosphere::test

#define FOREIGN_CACHE(variable, relative)                                             \
  const std::filesystem::path variable = ::photosphere::test::foreignCache(relative); \
  if (!std::filesystem::exists(variable))                                             \
  GTEST_SKIP() << "no foreign cache at " << variable.string() << " (set PHOTOSPHERE_FOREIGN_CACHES)"
