#pragma once
// How a frame's camera sees: which directions, how large, how sharp.

#include <vector>

#include "light_bounds.h"
#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// The directions in which light flies that the camera sees, a filter's reach beyond the frame and
/// through all of the lens.
DirectionCone seenDirections(const SceneFile& scene, const FrameSetup& setup);

/// Planes around all that the rays of a crop can meet through the middle of the lens, its pixel
/// filter included (render::viewPlanes).
std::vector<glm::dvec4> seenPlanes(const SceneFile& scene, const FrameSetup& setup,
                                   const render::Crop& crop);

/// How far a way in any direction reaches over the picture, as near as the nearest smoke is
/// [pixels per scene unit].
double pixelsPerUnit(const SceneFile& scene, const FrameSetup& setup);

/// The lens that `fstop` stands for: its radius is the focal length over twice the f-number; in
/// focus, by default, is the middle of the smoke.
render::Lens lensOf(const SceneFile& scene, const FrameSetup& setup);

/// Diameter of the circle of confusion of the frame's lens at the ends of the smoke [pixels].
double widestBlur(const SceneFile& scene, const FrameSetup& setup);

}  // namespace photosphere::scene
