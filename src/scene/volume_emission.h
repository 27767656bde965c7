#pragma once
// The `emission` of one `[[volume]]`: its grid as light given off.

#include <string>
#include <vector>

#include "photosphere/scene/scene_file.h"
#include "photosphere/transport/emission.h"
#include "smoke_source.h"

namespace photosphere::scene {

/// j at the nodes of the source's emission grid: value times scale and colour, or the radiance of
/// a black body at the node's temperature times scale. Voxels that are inactive or hold 0 emit
/// nothing, whatever `kelvin_offset` is.
/// @param localFromWorld  local space [m]
/// @param colorspace      rendering space that temperatures become colours in
/// @param notes           gets a sentence where colours outside that space were clipped
/// @throws InputError for a grid that is not scalar, or NaN, infinite or (values) negative;
///         ConfigError for a temperature in a space without known primaries; MemoryError
transport::VolumeEmission placeEmission(const VolumeEntry& entry, const VolumeSource& source,
                                        const Mat4d& localFromWorld, const std::string& colorspace,
                                        std::uint64_t budgetBytes, std::vector<std::string>& notes);

}  // namespace photosphere::scene
