#pragma once
// The table of hard cases: frames and traces at the edge of what numbers hold, each against an
// answer and a bound that were stated before (`photosphere study --hard`).

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace photosphere::study {

struct StabilityOptions {
  /// Folder of the catalogue; empty = data/hard beside the tool, or in the source tree.
  std::filesystem::path catalogue;
  bool quick = false;  ///< small size, as continuous integration runs it
  /// Part of each case's photons, samples and paths. Below 1 nothing is held against an answer: a
  /// row passes where its process comes to an end of its own, without NaN or negative samples. For
  /// builds that are slow and watch every access.
  double work = 1;
  std::vector<std::string> cases;       ///< names, or beginnings of names; empty = all
  std::vector<std::string> estimators;  ///< only these; empty = all
};

/// One case by one estimator.
struct StabilityRow {
  std::string kind;       ///< of the case: the catalogue's file
  std::string name;       ///< of the case
  std::string estimator;  ///< `-` where none takes part
  std::string hard;       ///< what is hard about it
  std::string oracle;     ///< where the known answer comes from
  std::string expected, result;
  double error = 0;  ///< relative
  double bound = 0;  ///< that it must not exceed
  std::uint64_t nanSamples = 0, negativeSamples = 0;
  double cappedPower = 0;  ///< part of the emitted power that the event budget ended
  double seconds = 0;      ///< wall clock, of the case's own run
  bool passed = false;
  std::string message;  ///< why it failed, or what it said
};

/// Runs the catalogue. Each run is a process of its own, so that a crash is a row that fails. The
/// calling process must have started no threads.
/// @param each  called with every row as it is known
/// @throws ConfigError for a catalogue that cannot be read or a name that is not in it;
///         InterruptedError
std::vector<StabilityRow> runStability(const StabilityOptions& options,
                                       const std::function<void(const StabilityRow&)>& each);

/// The head of the table and a row of it, as text of fixed columns without a final newline.
std::string stabilityHead();
std::string stabilityLine(const StabilityRow& row);

/// For each kind how many rows there are, how many fail, and which of the others comes closest to
/// its bound; lines without a final newline.
std::vector<std::string> stabilityDigest(const std::vector<StabilityRow>& rows);

/// All rows as CSV with a head. @throws OutputError
void writeStabilityCsv(const std::filesystem::path& path, const std::vector<StabilityRow>& rows);

}  // namespace photosphere::study
