#include "pictures.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "photosphere/image/preview.h"

namespace photosphere::study {

namespace {

/// Shade of an error in [-1, 1]. Its lightness grows all the way, so that grey prints read; a tint
/// of blue below and of orange above helps the eye.
std::array<float, 3> shade(double t) {
  const double v = 0.5 + 0.5 * std::clamp(t, -1.0, 1.0);
  const double tint = 0.22 * std::sin(2 * 3.14159265358979323846 * v);
  const auto level = [](double x) { return static_cast<float>(std::clamp(x, 0.0, 1.0)); };
  return {level(v - tint), level(v - 0.15 * tint), level(v + tint)};
}

double meanAt(const image::Image& image, std::size_t i) {
  double sum = 0;
  for (const char* name : {"R", "G", "B"})
    sum += static_cast<double>(image.channel(name)[i]) / 3;
  return sum;
}

}  // namespace

PictureSettings pictureSettings(const RunFacts& facts, const StudyOptions& options) {
  return {image::ColorConfig::load(options.ocioConfig), facts.renderingSpace, options.ocioDisplay,
          options.ocioView};
}

float exposureFor(const image::Image& reference) {
  std::vector<double> lit;
  for (std::size_t i = 0; i < reference.pixelCount(); ++i)
    if (const double v = meanAt(reference, i); v > 0) lit.push_back(v);
  if (lit.empty()) return 0;
  const std::size_t at = lit.size() * 99 / 100;
  std::nth_element(lit.begin(), lit.begin() + static_cast<std::ptrdiff_t>(at), lit.end());
  return static_cast<float>(std::log2(0.7 / lit[at]));
}

std::string framePicture(const image::Image& frame, float exposure,
                         const PictureSettings& settings) {
  image::DisplayOptions options;
  options.renderingSpace = settings.renderingSpace;
  options.display = settings.display;
  options.view = settings.view;
  options.exposure = exposure;
  return image::encodePreview(frame, settings.config, options);
}

std::string errorMapPicture(const image::Image& frame, const image::Image& reference) {
  double mean = 0;
  for (std::size_t i = 0; i < reference.pixelCount(); ++i)
    mean += meanAt(reference, i) / static_cast<double>(reference.pixelCount());
  std::vector<float> rgb;
  for (std::size_t i = 0; i < reference.pixelCount(); ++i) {
    const double ref = meanAt(reference, i), d = meanAt(frame, i) - ref;
    const double scale = std::sqrt(ref * ref + 0.01 * mean * mean);
    for (const float v : shade(scale > 0 ? d / scale / kMapLimit : 0))
      rgb.push_back(v);
  }
  return image::encodePng(reference.width(), reference.height(), rgb);
}

std::string errorScalePicture(int width, int height) {
  std::vector<float> rgb;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (const float v : shade(width > 1 ? 2.0 * x / (width - 1) - 1 : 0))
        rgb.push_back(v);
  return image::encodePng(width, height, rgb);
}

}  // namespace photosphere::study
