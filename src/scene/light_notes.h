#pragma once
// What a frame says of stored light that is too coarse for its smoke.

#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// |g| of the sharpest lobe that any of the smoke scatters by; 0 without smoke.
double sharpestLobe(const transport::Medium& medium);

/// Adds a note where light is stored by directions that are far apart for a lobe: what is scattered
/// into it shows all over a bin.
void noteCoarseDirections(FrameSetup& setup);

/// Adds a note where the eye is in smoke that does not scatter evenly, and directions are kept
/// there that are not kept elsewhere, or should be.
void noteEyeInSmoke(FrameSetup& setup);

/// Adds a note where fewer particles carry light than one look-up takes.
void noteFewCarriers(FrameSetup& setup);

}  // namespace photosphere::scene
