#pragma once
// Frame-to-frame error: what the eye sees as flicker.

#include <filesystem>
#include <string>
#include <vector>

#include "contenders.h"
#include "photosphere/study/result.h"
#include "reference.h"

namespace photosphere::study {

struct FlickerPlan {
  SceneSource scene;
  std::int64_t frame = 1;            ///< of the still scene
  std::vector<std::int64_t> moving;  ///< frames of the moving one; fewer than 2: none
  int stillFrames = 3;
  int seeds = 3;
  bool quick = false;
  std::vector<std::string> particleSets;
  std::filesystem::path cacheFolder, runFolder;
  std::string referenceName;
  int chunk = 64;
  double seconds = 0;  ///< budget; what does not fit is left out
};

/// relMSE of the difference of the errors of two frames: of (b - a) - (referenceB - referenceA)
/// against referenceB, the noise of both references subtracted.
double frameToFrameError(const image::Image& a, const image::Image& b,
                         const ReferenceImage& referenceA, const ReferenceImage& referenceB,
                         std::size_t layer);

/// Renders every contender of a short table over both sequences with `seed_per_frame` on and off.
/// @param leftOut  receives what could not be measured, and why
std::vector<FlickerRow> measureFlicker(const FlickerPlan& plan, std::vector<LeftOut>& leftOut);

}  // namespace photosphere::study
