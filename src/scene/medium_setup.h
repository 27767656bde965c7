#pragma once
// The smoke of a frame, from its caches to a medium in local space.

#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// Fills `medium`, `particles`, `space` and `worldBounds`, in two passes: where the smoke is, then
/// the smoke about its own centre. Notes and seconds go to the set-up; its memory budget is heeded.
/// @param scene       at the frame
/// @param cacheFrame  of the caches
/// @throws what setUpFrame throws for caches
void buildMedium(const SceneFile& scene, std::int64_t cacheFrame, bool wantParticles,
                 FrameSetup& setup);

}  // namespace photosphere::scene
