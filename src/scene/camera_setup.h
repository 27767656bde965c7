#pragma once
// The camera of a frame, and what it does while its shutter is open.

#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// Degrees across the frame, as the camera's own options say.
double horizontalFov(const ParamValues& camera);

/// Fills `camera`, `view` and, where keys or a file move the camera, `motion`.
/// @param scene  at the frame; the smoke of `setup` stands
/// @throws ConfigError
void buildCamera(const SceneFile& scene, FrameSetup& setup);

/// Makes `view` that of the middle of the shutter, where the camera moves.
void viewFromTheMiddle(FrameSetup& setup);

}  // namespace photosphere::scene
