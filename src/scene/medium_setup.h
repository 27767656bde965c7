#pragma once
// The smoke of a frame, from its caches to a medium in local space.

#include <optional>

#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// Optical depth of one voxel from where on more of it shows nowhere: the eye sees 1 % of such a
/// voxel's edge deep, and of light that scatters without loss 1 / 10,000 passes. More is taken as
/// that: distances between collisions would be lost in the rounding of positions, and extinction in
/// the range of a float.
inline constexpr double kMostVoxelDepth = 1e4;

/// Fills `medium`, `particles`, `space` and `worldBounds`, in two passes: where the smoke is, then
/// the smoke about its own centre. Notes and seconds go to the set-up; its memory budget is heeded.
/// @param scene       at the frame
/// @param cacheFrame  of the caches
/// @param center      of local space [scene units]; nothing = the middle of all smoke
/// @throws what setUpFrame throws for caches
void buildMedium(const SceneFile& scene, std::int64_t cacheFrame, bool wantParticles,
                 const std::optional<Vec3d>& center, FrameSetup& setup);

}  // namespace photosphere::scene
