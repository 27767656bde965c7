#pragma once
// Options of the commands that work on a scene: plan, trace and render.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "job_files.h"
#include "options.h"
#include "photosphere/core/frames.h"
#include "photosphere/scene/pipeline.h"
#include "photosphere/scene/scene_file.h"
#include "resume.h"

namespace photosphere::cli {

struct SceneOptions {
  std::string scene;
  std::vector<std::string> sets;
  std::optional<std::int64_t> seed;
  std::string resolution, colorspace;
  std::int64_t cacheOffset = 0;
  std::string cacheHold;
  std::string stats;
  bool allowStale = false, allowInvalid = false;
  bool dumpScene = false;
  ResumeOptions resume;
  FrameOptions frames;
};

void addSceneOptions(CLI::App& app, SceneOptions& options);
/// Those of them that act where nothing is written.
void addPlanOptions(CLI::App& app, SceneOptions& options);

/// The scene that the options name, with their overrides: a .toml file, or any cache, for which a
/// scene is made up and its choices are reported.
/// @throws ConfigError, InputMissingError, InputError
scene::SceneFile openScene(const SceneOptions& options);

/// Frames to make: --frames, else scene.frames, else those of the first numbered cache, else 1.
/// @throws InputMissingError when that cache has no file
std::vector<std::int64_t> sceneFrameList(const scene::SceneFile& scene,
                                         const SceneOptions& options);

/// Which frame of the caches goes with a frame of the picture (--cache-offset, --cache-hold).
class CacheFrames {
 public:
  CacheFrames(const scene::SceneFile& scene, const SceneOptions& options);
  /// @return false where `clip` leaves nothing to show
  bool map(std::int64_t frame, std::int64_t& cacheFrame) const;

 private:
  std::int64_t m_offset = 0, m_first = 0, m_last = 0;
  std::optional<CacheHold> m_hold;
};

/// All that a scene reads at these frames: itself, caches, camera, pictures, stored light.
JobFiles filesRead(const scene::SceneFile& scene, const std::vector<std::int64_t>& frames,
                   const CacheFrames& cacheFrames);

/// The job that makes these frames.
/// @param more     what decides its outputs beside the scene
/// @param outputs  patterns of what each frame leaves, its own first; an empty one is fine
ResumableJob resumableJob(const scene::SceneFile& scene, const SceneOptions& options,
                          const std::string& more, const std::vector<std::int64_t>& frames,
                          const CacheFrames& cacheFrames, const std::vector<std::string>& outputs);

/// What --dry-run prints of the first frame: what would be simulated, and the memory for it.
/// @throws what scene::setUpFrame throws
void printPlan(const scene::SceneFile& scene, std::int64_t frame,
               const scene::RenderRequest& request, bool forLightCache);

/// A line an effect: its name, on or off, the bound of what is left out, why.
void printEffects(const std::vector<scene::EffectState>& effects);

/// What --dry-run prints of every frame.
/// @param smoke  false where --cache-hold clip leaves nothing to show
void printDryRun(std::int64_t frame, const std::string& output, std::int64_t cacheFrame,
                 bool smoke);

/// `read 0.10, rasterize 0.00, ..., total 2.40 s`.
std::string formatSeconds(const scene::StageSeconds& seconds);

}  // namespace photosphere::cli
