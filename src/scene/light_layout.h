#pragma once
// How a frame stores its light: what the scene leaves to the tool is chosen by the smoke.

#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// Fills `setup.layout`, with a note for each choice that differs from the usual one. Its medium,
/// lights, camera and effects are known by then.
/// @param forLightCache  of light that serves other frames, too
void chooseLayout(const SceneFile& scene, bool forLightCache, FrameSetup& setup);

}  // namespace photosphere::scene
