#pragma once
// The effects that a frame simulates: decided from its data, not from which keys its scene has.
//
// Off is what adds exactly nothing (bound 0), and what is bounded below the scene's tolerance: a
// part of the mean radiance of the pixels that show smoke. All that is left out for that shares one
// budget, so that the sum of the bounds stays below the tolerance, in the order of what leaving it
// out saves: light scattered twice or more, volumes out of view, faint lamps, faint glow, shadows,
// depth of field. The bounds are inequalities (light_bounds.h, unseen_volumes.h), but for depth of
// field, which is judged by the steepest step of a small picture of the frame (pre_render.h).

#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// True when no phase function prefers a direction: light is then stored without directions.
bool scattersEvenly(const transport::Medium& medium);

/// Fills `effects`, `effectStates` and `lens` of a frame whose medium, lights and camera stand, and
/// takes away volumes, lamps, glow and motion that add nothing or too little.
/// @param forOtherViews  the light is kept for cameras that are not known: then only what adds
///                       exactly nothing to any picture is left out of it
/// @throws ConfigError where the scene switches off what it cannot do without
void planEffects(const SceneFile& scene, bool forOtherViews, FrameSetup& setup);

}  // namespace photosphere::scene
