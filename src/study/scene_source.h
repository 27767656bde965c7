#pragma once
// A scene that can be opened again and again with other settings.

#include <filesystem>
#include <string>
#include <vector>

#include "photosphere/scene/scene_file.h"

namespace photosphere::study {

/// What names a scene: a file and overrides, as on the command line.
struct SceneSource {
  std::filesystem::path path;
  std::vector<std::string> sets;

  /// The scene with more overrides. @throws what scene::loadScene and sceneForVolume throw
  scene::SceneFile open(const std::vector<std::string>& more = {}) const;
  SceneSource with(const std::vector<std::string>& more) const;
};

/// Identifies what a reference shows: camera, smoke, lights and effects, wherever a value differs
/// from its default, and the content of the medium. Estimator, seed and sampling are left out.
/// @param mediumHash  of the frame
std::string referenceKey(const scene::SceneFile& scene, std::int64_t frame,
                         const std::string& mediumHash);

}  // namespace photosphere::study
