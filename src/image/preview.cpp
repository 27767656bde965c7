#include "photosphere/image/preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "openimageio.h"
#include "photosphere/core/error.h"
#include "photosphere/core/output_file.h"
#include "photosphere/core/parallel.h"

namespace photosphere::image {
namespace {

std::string formatOf(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".png") return "png";
  if (extension == ".jpg" || extension == ".jpeg") return "jpeg";
  throw ConfigError(
      fmt::format("{}: a preview is .png, .jpg or .jpeg; linear pixels go to .exr", path.string()));
}

/// What the display shows, rows of the display window as r, g, b in [0, 1].
std::vector<float> displayPixels(const Image& image, const ColorConfig& config,
                                 const DisplayOptions& options) {
  const ColorConverter toDisplay =
      config.displayConverter(options.renderingSpace, options.display, options.view);
  const std::span<const float> r = image.channel(Image::channelName(options.layer, "R"));
  const std::span<const float> g = image.channel(Image::channelName(options.layer, "G"));
  const std::span<const float> b = image.channel(Image::channelName(options.layer, "B"));
  const Window& window = image.displayWindow();
  const Window shown = intersection(window, image.dataWindow());
  const float gain = std::exp2(options.exposure);
  const auto rowSize = static_cast<std::size_t>(window.width) * 3;
  std::vector<float> pixels(rowSize * static_cast<std::size_t>(window.height));
  parallelFor(static_cast<std::size_t>(window.height), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      float* out = pixels.data() + row * rowSize;
      const int y = window.y + static_cast<int>(row);
      for (int column = 0; column < window.width; ++column) {
        if (!shown.contains(window.x + column, y)) continue;
        const std::size_t i = image.index(window.x + column, y);
        out[3 * column] = r[i] * gain;
        out[3 * column + 1] = g[i] * gain;
        out[3 * column + 2] = b[i] * gain;
      }
      toDisplay.apply({out, rowSize});
    }
  });
  return pixels;
}

std::string encode(const std::string& path, const std::string& format, const Window& window,
                   std::span<const float> pixels, const DisplayOptions& options) {
  PictureEncoding encoding{format.c_str(), window.width, window.height, options.dither, {}};
  if (format == "jpeg") encoding.compression = fmt::format("jpeg:{}", options.jpegQuality);
  std::string bytes;
  const std::string wrong = openImageIo().encode(encoding, pixels.data(), bytes);
  if (!wrong.empty()) throw OutputError(path, "cannot encode this preview: " + wrong);
  return bytes;
}

}  // namespace

std::string encodePreview(const Image& image, const ColorConfig& config,
                          const DisplayOptions& options) {
  const std::vector<float> pixels = displayPixels(image, config, options);
  return encode("preview.png", "png", image.displayWindow(), pixels, options);
}

std::string encodePng(int width, int height, std::span<const float> rgb) {
  if (width < 1 || height < 1 ||
      rgb.size() != 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw ConfigError("a picture to encode has another size than its pixels");
  return encode("picture.png", "png", {0, 0, width, height}, rgb, {});
}

void checkPreview(const std::filesystem::path& path, const ColorConfig& config,
                  const DisplayOptions& options) {
  formatOf(path);
  openImageIo();
  config.displayConverter(options.renderingSpace, options.display, options.view);
}

void writePreview(const std::filesystem::path& path, const Image& image, const ColorConfig& config,
                  const DisplayOptions& options) {
  const std::string format = formatOf(path);
  const std::vector<float> pixels = displayPixels(image, config, options);
  writeFile(path, encode(path.string(), format, image.displayWindow(), pixels, options));
}

}  // namespace photosphere::image
