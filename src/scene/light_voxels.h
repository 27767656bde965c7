#pragma once
// Voxels that light is stored in, and how it is smoothed there.

#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// Radius of the kernel over fluence that the work grows with the third power of [light voxels].
/// Four are mush already (estimators::automaticRadius).
inline constexpr int kMostVoxelsWide = 8;

/// Weighs photons by what is seen of them where the smoke is many mean free paths deep in each
/// light voxel and the scene leaves the choice: such weights serve voxels of any depth.
void chooseSmoothing(const ParamValues& estimator, FrameSetup& setup);

/// Halves light voxels where the scene leaves the choice and the smoke is few of them across,
/// several mean free paths deep in each, or in clumps of their size; doubles them where they are
/// many times the smoke's own. After chooseSmoothing.
void chooseLightVoxel(const ParamValues& estimator, FrameSetup& setup);

}  // namespace photosphere::scene
