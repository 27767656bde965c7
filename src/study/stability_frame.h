#pragma once
// One frame of the table of hard cases, in a process of its own.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "photosphere/core/error.h"
#include "photosphere/scene/pipeline.h"

namespace photosphere::study {

struct StabilityFrameJob {
  scene::SceneFile scene;
  scene::RenderRequest request;
  std::string layer = "beauty";
  int seeds = 1;       ///< frames of as many seeds, whose mean is wanted
  std::string writes;  ///< not empty: the frame is written as EXR and read back
  std::filesystem::path exr;
  double cpuLimit = 60;  ///< seconds of processor time, then the process is ended
};

struct StabilityFrame {
  bool failed = false;
  ExitCode code = ExitCode::ok;
  std::string message;
  int width = 0, height = 0;
  std::vector<double> pixels;  ///< R, G, B of the layer
  std::uint64_t nanSamples = 0, negativeSamples = 0, majorantViolations = 0;
  double cappedShare = 0;  ///< power that the event budget ended, of what was emitted
  double seconds = 0;
  std::string notes;     ///< all of them
  std::string fileType;  ///< `half`, `float`; of `writes`, with what is wrong
};

StabilityFrame renderStabilityFrame(const StabilityFrameJob& job);

/// sqrt(relMSE) of METHOD.md section 7 over means of square blocks of pixels; infinite where either
/// frame holds what is not finite, or the sizes differ. Two black frames agree.
/// @param block  edge [pixels]
/// @param scale  of the reference
double blockError(const StabilityFrame& frame, const StabilityFrame& reference, int block,
                  double scale);

/// The same of the mean of each channel over the frame.
double meanError(const StabilityFrame& frame, const StabilityFrame& reference, double scale);

/// What a row is judged by: the larger of the two. Where one bright block is off, the others
/// outvote it over blocks, and not in the mean.
double frameError(const StabilityFrame& frame, const StabilityFrame& reference, int block,
                  double scale);

/// Mean over pixels and channels.
double meanOf(const StabilityFrame& frame);

}  // namespace photosphere::study
