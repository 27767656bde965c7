#pragma once
// What a study finds: figures of every contender, ready for tables and plots.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "photosphere/image/image.h"
#include "photosphere/scene/pipeline.h"

namespace photosphere::study {

/// A value with its 95 % interval.
struct Estimate {
  double value = 0;
  double low = 0, high = 0;
};

/// Of several runs.
struct Spread {
  double median = 0, min = 0, max = 0;
};

/// The middle value (mean of the middle two), least and largest. All 0 for no values.
Spread spreadOf(std::vector<double> values);

/// Layers that are measured, in the order of every array below.
inline constexpr std::array<const char*, 2> kLayers{"total", "multiple"};
inline constexpr std::size_t kTotal = 0, kMultiple = 1;
/// Pixels that are measured: all, and those whose reference transmittance is below 0.99.
inline constexpr std::array<const char*, 2> kRegions{"all", "smoke"};
inline constexpr std::size_t kAllPixels = 0, kSmokeOnly = 1;

/// Errors of one layer over one region against the reference, whose own noise is subtracted.
/// Relative as in relMSE (image/metrics.h): biasSquared + variance = relMse in expectation.
struct ErrorFigures {
  Estimate relMse;            ///< of one frame; mean over the seeds, t-interval over them
  Estimate biasSquared;       ///< what more seeds would not remove; jackknife t-interval
  Estimate variance;          ///< of one frame about its own mean; jackknife t-interval
  Estimate meanRatio;         ///< mean of the frame over mean of the reference; t-interval
  double referenceNoise = 0;  ///< relMSE that the reference's noise would add; subtracted above
};
using LayerFigures = std::array<std::array<ErrorFigures, 2>, 2>;  ///< [layer][region]

/// Relative error, sqrt(relMSE) [1]; 0 where the unbiased estimate fell below.
double relativeError(const ErrorFigures& figures);

struct StageSpreads {
  Spread read, rasterize, trace, resolve, march, total;  ///< [s]
};

/// One setting of one family of contenders, over all its seeds.
struct PointResult {
  std::string family;    ///< such as "view"
  std::string label;     ///< such as "view, 250k photons"
  std::string settings;  ///< overrides of the scene, `key=value; key=value`
  std::int64_t work =
      0;  ///< photons emitted, samples or rays a pixel, or 1 over the error asked for
  int seeds = 0;
  StageSpreads seconds;
  Spread cpuSeconds;
  Spread peakMemoryBytes;  ///< of a process that rendered this alone
  std::uint64_t photonsStored = 0;
  std::uint64_t lightMemoryBytes = 0;  ///< that the stored light takes
  LayerFigures errors;
  Spread estimatedError;  ///< that the frames give of themselves, layer total; 0 without
  image::Image frame;     ///< R, G, B of the first seed; of a family's most work alone
};

struct LeftOut {
  std::string name, why;
};

/// What is known of the reference of a sweep.
struct ReferenceNote {
  std::string key;
  std::string method;  ///< estimator.type that it is made with
  std::string origin;  ///< file it was continued from; empty when rendered anew
  std::uint64_t samplesBefore = 0, samples = 0;  ///< a pixel, as found and in all
  double seconds = 0;                            ///< spent on it in this run
  std::array<double, 2> noise{};                 ///< relMSE of its own noise, [layer], all pixels
  /// The same from the spread of contenders of the reference's own method, whose weights do not
  /// depend on the reference's outliers; 0 where there are none.
  std::array<double, 2> pathNoise{};
  bool quiet = false;    ///< noise at most a tenth of the best contender's relMSE
  bool settled = false;  ///< twice as many paths showed the contenders no better
};

/// One scene swept.
struct SweepResult {
  std::string name;         ///< "scene" or the name of a hard case
  std::string description;  ///< what is special about it
  std::vector<std::string> sets;
  int width = 0, height = 0;
  std::uint64_t startMemoryBytes = 0;  ///< peak of a child that did nothing, before this sweep
  std::vector<PointResult> points;
  std::vector<LeftOut> leftOut;
  ReferenceNote reference;
  image::Image referenceImage;  ///< layers total, multiple, transmittance and variances
};

/// Frame-to-frame error of one contender over frames [1]: relMSE of the difference of successive
/// frames' errors.
struct FlickerRow {
  std::string sequence;  ///< "still" or "moving"
  std::string label;
  bool seedPerFrame = false;
  int pairs = 0;
  Estimate relMse;  ///< t-interval over the seeds
};

/// With what, on what and for how long was measured.
struct RunFacts {
  std::string version, machine, date, renderingSpace;
  unsigned threads = 0;
  double minutes = 0, elapsedSeconds = 0;
  bool quick = false;
};

/// Everything that the report shows.
struct StudyResult : RunFacts {
  std::string scene;  ///< path
  std::int64_t frame = 1;
  Spread startSeconds;  ///< a child process that does nothing: its start and end
  std::uint64_t startMemoryBytes = 0;
  std::vector<SweepResult> sweeps;  ///< first the scene itself, then the hard cases
  std::vector<SweepResult> bases;   ///< the scene with one g after the other
  std::vector<FlickerRow> flicker;
  std::vector<LeftOut> leftOut;
};

}  // namespace photosphere::study
