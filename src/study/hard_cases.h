#pragma once
// Scenes in which the photosphere has a hard time, made from the scene under study.

#include <string>
#include <vector>

#include "child.h"
#include "scene_source.h"

namespace photosphere::study {

struct HardCase {
  std::string name, description;
  std::vector<std::string> sets;  ///< over the scene
  std::uint64_t particles = 0;    ///< carriers of `particles`, seeded; 0 = those of the scene
};

/// The scene with Henyey-Greenstein phases, g from -0.5 to 0.95, in which bases are compared.
std::vector<HardCase> basisCases(const scene::SceneFile& scene, bool quick);

/// Few particles, forward-peaked phase, thin smoke, a lamp inside, a hard shadow edge.
std::vector<HardCase> hardCases(const scene::SceneFile& scene, const SceneFacts& facts);

}  // namespace photosphere::study
