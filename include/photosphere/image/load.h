#pragma once
// Pictures made elsewhere: environment maps and textures.

#include <filesystem>
#include <string>

#include "photosphere/image/image.h"

namespace photosphere::image {

struct LoadedImage {
  Image image;  ///< R, G, B; a grey picture has three equal channels
  std::string
      colorSpace;  ///< what the file says or its format implies, such as `sRGB`; may be empty
};

/// Loads any picture that OpenImageIO reads as float RGB, with its values as they are: converting
/// them to the rendering space is the caller's (ColorConfig::converter).
/// @throws InputMissingError when it cannot be opened
/// @throws InputError when no reader knows it, or it is damaged
LoadedImage loadImage(const std::filesystem::path& path);

}  // namespace photosphere::image
