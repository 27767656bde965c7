#pragma once
// Photons and light voxels where the picture can see their effect.

#include "photosphere/render/frame.h"
#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// Limits stored light to what the crop shows, and steers photons toward what it gains from, where
/// that is asked for or pays. For a frame that traces its light itself.
void aimLight(const SceneFile& scene, const render::Crop& crop, FrameSetup& setup);

}  // namespace photosphere::scene
