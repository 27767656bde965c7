#pragma once
// `photosphere study`: error against time over estimators and settings.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/study/result.h"

namespace photosphere::study {

/// What a command line asks for.
struct StudyOptions {
  std::filesystem::path scene;        ///< .toml, or a cache for which a scene is made up
  std::vector<std::string> sets;      ///< overrides, `key=value`
  std::filesystem::path output;       ///< folder of the report
  std::filesystem::path cache;        ///< folder of references; empty = `output`/cache
  std::vector<std::int64_t> frames;   ///< the last is studied; flicker moves over all
  double minutes = 0;                 ///< that the study should take, about; 0 = 10, quick 0.1
  int seeds = 5;                      ///< at least 3
  std::vector<std::string> families;  ///< of contenders; empty = all
  bool hardCases = true, flicker = true;
  bool bases = false;    ///< compare the bases of directions for many g
  bool quick = false;    ///< tiny frames and little work, to try the command
  unsigned threads = 0;  ///< as reported
  std::string ocioConfig, ocioDisplay, ocioView;  ///< of the pictures; empty = defaults
};

/// Longest edge of a studied frame [pixels].
inline constexpr int kLargestEdge = 256;

/// The override that brings a scene's resolution down to at most 256 pixels an edge; empty where it
/// is within that. @param quick  at most 32
std::string resolutionOverride(const Vec2i& resolution, bool quick);

/// Measures. The calling process must have started no threads: every run is a process of its own.
/// @throws ConfigError for options and scenes that cannot be studied; InputError and others from
/// the
///         scene; InterruptedError, after which the references so far are in the cache folder
StudyResult runStudy(const StudyOptions& options);

/// Writes study.csv, study.json and index.html into `options.output`.
/// @throws ConfigError naming the package when gnuplot is missing; OutputError
void writeReport(const StudyResult& result, const StudyOptions& options);

/// gnuplot's version line. @throws ConfigError naming the package when it is missing
std::string gnuplotVersion();

}  // namespace photosphere::study
