#pragma once
// What of the smoke a picture shows, and which light it gains from.

#include <vector>

#include "photosphere/cameras/camera.h"
#include "photosphere/core/rng.h"
#include "photosphere/lights/light.h"
#include "photosphere/render/frame.h"
#include "photosphere/transport/importance.h"
#include "photosphere/transport/medium.h"

namespace photosphere::render {

/// Planes around all that the rays of a crop can meet, as (unit normal inward, offset): a point p
/// lies inside where dot(normal, p) + offset >= 0 for all. Local space [m]. Empty for a panorama.
/// @param border  pixels beyond the crop that filters reach
std::vector<glm::dvec4> viewPlanes(const cameras::Camera& camera, const Crop& crop, double border,
                                   const lights::LocalSpace& space);

/// Part of the smoke that lies within planes, by the bounds of its extinction; 1 without planes.
double visibleShare(const transport::Medium& medium, const std::vector<glm::dvec4>& planes);

/// Part of the lamps' power at the smoke's bounding sphere that is sent on rays which meet smoke.
double hittingShare(const transport::Medium& medium, const transport::LightList& lights);

/// Adjoint fluence of a picture whose pixels all count alike: random paths from the camera leave
/// the lengths of their flights after the first collision. The same for any number of threads.
transport::ImportanceMap viewImportance(const cameras::Camera& camera, const Crop& crop,
                                        const lights::LocalSpace& space,
                                        const transport::Medium& medium, RandomKey key);

}  // namespace photosphere::render
