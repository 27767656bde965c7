#pragma once
// Why a frame shows nothing.

#include <string>

#include "photosphere/render/frame.h"
#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// True where no pixel of `beauty` holds any light.
bool isBlack(const render::FrameLayers& layers);

/// Why a black frame is, as far as it is known.
std::string whyBlack(const SceneFile& scene, const FrameSetup& setup,
                     const render::FrameLayers& layers);

}  // namespace photosphere::scene
