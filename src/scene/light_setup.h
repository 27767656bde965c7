#pragma once
// The lamps of a frame.

#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// Fills `lights`.
/// @param scene  at the frame; the smoke of `setup` stands
/// @throws ConfigError for what a lamp cannot be, or more light than photons can carry; InputError
///         for pictures with values that are no light, unless the scene allows them
void buildLights(const SceneFile& scene, FrameSetup& setup);

}  // namespace photosphere::scene
