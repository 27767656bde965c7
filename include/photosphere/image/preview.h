#pragma once
// 8-bit pictures for people.

#include <filesystem>
#include <span>
#include <string>

#include "photosphere/image/color.h"
#include "photosphere/image/image.h"

namespace photosphere::image {

struct DisplayOptions {
  std::string layer = {};  ///< empty: R, G, B
  std::string renderingSpace{kDefaultRenderingSpace};
  std::string display = {};  ///< empty: the config's default
  std::string view = {};     ///< empty: the display's default
  float exposure = 0.0f;     ///< [stops]
  bool dither = false;       ///< else rounded to the nearest of 256 levels
  int jpegQuality = 92;
};

/// The bytes of a PNG of the display window, as writePreview makes it.
/// @throws ConfigError as writePreview; OutputError when it cannot be encoded
std::string encodePreview(const Image& image, const ColorConfig& config,
                          const DisplayOptions& options = {});

/// The bytes of a PNG of display values in [0, 1] as they are: r, g, b, row by row from the top.
/// @throws ConfigError when `rgb` is not 3 * width * height values; OutputError
std::string encodePng(int width, int height, std::span<const float> rgb);

/// What writePreview would refuse before it has any pixels.
/// @throws ConfigError for another extension, an unknown space, display or view
void checkPreview(const std::filesystem::path& path, const ColorConfig& config,
                  const DisplayOptions& options = {});

/// Writes a PNG or JPEG, by the path's extension, of the display window: black outside the data
/// window, premultiplied colour over black. Whole or not at all.
/// @throws ConfigError for another extension, an unknown layer, space, display or view
/// @throws OutputError when it cannot be written
void writePreview(const std::filesystem::path& path, const Image& image, const ColorConfig& config,
                  const DisplayOptions& options = {});

}  // namespace photosphere::image
