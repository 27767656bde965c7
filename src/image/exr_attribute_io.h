#pragma once
// Attributes between this project's types and OpenEXR's.

#include <OpenEXR/ImfHeader.h>

#include "photosphere/image/exr_attributes.h"

namespace photosphere::image {

/// @throws Iex::BaseExc when a reserved name gets a value of another type
void putAttributes(const ExrAttributes& attributes, Imf::Header& header);
ExrAttributes getAttributes(const Imf::Header& header);

}  // namespace photosphere::image
