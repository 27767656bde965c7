#pragma once
// A spot with a body, for soft shadows.

#include <memory>

#include "falloff.h"

namespace photosphere::lights {

/// A ball whose every point shines with the falloff of a spot about one axis: far away it has the
/// intensity of that spot in every direction, near by its shadows and the edge of its cone soften.
/// Dark inside the ball.
/// @param position   of its centre, local space [m]
/// @param axis       unit, along propagation
/// @param intensity  on the axis [W/sr]
/// @param radius     above 0 [m]
std::unique_ptr<Light> makeSoftSpot(const Vec3d& position, const Vec3d& axis, const Rgb& intensity,
                                    const Falloff& falloff, double radius);

}  // namespace photosphere::lights
