#pragma once
// The albedo that a volume really has where there is smoke.

#include "photosphere/transport/medium.h"

namespace photosphere::transport {

/// Upper bound of the albedo of every channel where the volume's trilinear density is above zero:
/// of a grid, the largest node that a lookup inside such a voxel cell reads. 0 without density.
float largestAlbedo(const MediumVolume& volume);

}  // namespace photosphere::transport
