#pragma once
// The effects that a frame simulates: decided from its data, not from which keys its scene has.

#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// Degrees across the frame, as the camera's own options say.
double horizontalFov(const ParamValues& camera);

/// Fills `effects`, `effectStates` and `lens` of a frame whose medium, lights and camera stand.
/// @throws ConfigError where the scene switches off what it cannot do without
void planEffects(const SceneFile& scene, FrameSetup& setup);

}  // namespace photosphere::scene
