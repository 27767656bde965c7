#pragma once
// Work in a process of its own, so that its peak memory is its own.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "photosphere/core/error.h"
#include "photosphere/scene/pipeline.h"

namespace photosphere::study {

/// How a child process ended.
struct ChildResult {
  std::string text;  ///< what its work returned; empty when it failed
  bool failed = false;
  ExitCode code = ExitCode::ok;
  std::string message;  ///< why it failed
  double seconds = 0;   ///< from the fork to the end, wall clock
};

/// Runs `work` in a forked child and returns its text. It must be called while this process has no
/// other threads: the study starts none before its last child has ended. A signal that asks this
/// process to stop is passed on.
/// @param cpuSeconds  processor time after which the child is ended, as a failure; 0 = no limit
/// @throws InterruptedError once the child has ended after a signal; Error when no child can start
ChildResult runInChild(const std::function<std::string()>& work, double cpuSeconds = 0);

/// Whether the message of a failure tells of a process that died, and not of an error that it had
/// to report.
bool tellsOfDeath(std::string_view message);

/// One frame to render in a child.
struct RenderJob {
  scene::SceneFile scene;
  std::int64_t frame = 1;
  scene::RenderRequest request;
  std::filesystem::path image;  ///< where the child leaves its layers, as 32-bit float EXR
};

struct RenderOutcome {
  bool failed = false;
  ExitCode code = ExitCode::ok;
  std::string message;
  scene::StageSeconds seconds;
  double cpuSeconds = 0;
  std::uint64_t peakMemoryBytes = 0, photonsStored = 0, pathsCapped = 0;
  std::uint64_t lightMemoryBytes = 0;  ///< of the light field or photon map
  double estimatedError = 0;           ///< where the scene has a target error
};

/// Renders and leaves layers `total`, `multiple` and `transmittance` (each R, G, B, kind data;
/// black where the frame has no such layer) in `job.image`.
RenderOutcome renderInChild(const RenderJob& job);

/// What must be known of a scene before it is swept.
struct SceneFacts {
  std::string mediumHash;
  int width = 0, height = 0;
  Box3d bounds;  ///< of the smoke, world space; empty without smoke
  bool multipleScattering = false;
  std::uint64_t lightBytes = 0;  ///< forecast for its stored light
};
/// Sets the scene up in a child. @throws the child's failure as Error
SceneFacts sceneFacts(const scene::SceneFile& scene, std::int64_t frame);

}  // namespace photosphere::study
