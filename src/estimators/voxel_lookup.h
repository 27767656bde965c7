#pragma once
// Trilinear reading of voxel-carried values where some neighbours are inactive.

#include <vector>

#include "photosphere/estimators/light_field.h"

namespace photosphere::estimators {

/// Values of a voxel field at positions: trilinear over the active neighbours, inactive ones
/// leaving both sum and weight. @return [position][valuesPerCarrier]; zero far from every active
/// voxel
std::vector<float> sampleAtParticles(const LightField& field, const std::vector<Vec3f>& positions);

}  // namespace photosphere::estimators
