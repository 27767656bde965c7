#pragma once
// A small picture of a frame, before anything is traced: what the plan's bounds are held against.

#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

struct PreRender {
  /// Of the pixels that show smoke, over the channels: emission, light of lamps scattered once, and
  /// what shines through [W m^-2 sr^-1]. 0 where no pixel shows any.
  double meanRadiance = 0;
  /// Largest difference between pixels next to each other in the full frame, of any channel
  /// [W m^-2 sr^-1 a pixel].
  double steepest = 0;
};

/// Marches single rays through pixels spread over the frame, 32 across, with shadows. Without light
/// scattered twice or more, so that the mean is rather too small. The same bits for any number of
/// threads.
PreRender preRender(const FrameSetup& setup, const Effects& effects);

}  // namespace photosphere::scene
