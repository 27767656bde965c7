#include "photosphere/image/metrics.h"

#include <fmt/format.h>

#include <cmath>

#include "photosphere/core/error.h"

namespace photosphere::image {
namespace {

using Planes = std::vector<std::span<const float>>;

bool allFinite(const Planes& planes, std::size_t pixel) {
  for (const auto& plane : planes)
    if (!std::isfinite(plane[pixel])) return false;
  return true;
}

/// Such as an infinite depth where both see nothing. NaN equals nothing.
bool identical(const Planes& a, const Planes& b, std::size_t pixel) {
  for (std::size_t c = 0; c < a.size(); ++c)
    if (!(a[c][pixel] == b[c][pixel])) return false;
  return true;
}

void checkSizes(const Planes& image, const Planes& reference, const MeasureOptions& options) {
  bool same = !reference.empty() && image.size() == reference.size();
  const std::size_t count = reference.empty() ? 0 : reference[0].size();
  for (const auto* planes : {&image, &reference, &options.referenceVariance})
    for (const auto& plane : *planes)
      same = same && plane.size() == count;
  same = same && (options.mask.empty() || options.mask.size() == count);
  same = same && (options.referenceVariance.empty() ||
                  options.referenceVariance.size() == reference.size());
  if (!same) throw ConfigError("images to compare differ in size or number of channels");
}

/// Pixels to measure, the finite among those of the mask; counts the others into `metrics`.
std::vector<std::size_t> selectPixels(const Planes& image, const Planes& reference,
                                      const MeasureOptions& options, ErrorMetrics& metrics) {
  std::vector<std::size_t> selected;
  selected.reserve(reference[0].size());
  for (std::size_t i = 0; i < reference[0].size(); ++i) {
    if (!options.mask.empty() && !options.mask[i]) continue;
    const bool imageFinite = allFinite(image, i);
    const bool referenceFinite = allFinite(reference, i);
    if (!(imageFinite && referenceFinite) && identical(image, reference, i)) continue;
    metrics.nonFiniteImage += imageFinite ? 0 : 1;
    metrics.nonFiniteReference += referenceFinite ? 0 : 1;
    if (imageFinite && referenceFinite) selected.push_back(i);
  }
  return selected;
}

double meanOf(const Planes& planes, const std::vector<std::size_t>& pixels) {
  double sum = 0;
  for (const std::size_t i : pixels)
    for (const auto& plane : planes)
      sum += plane[i];
  return sum / (static_cast<double>(pixels.size()) * static_cast<double>(planes.size()));
}

}  // namespace

ErrorMetrics measure(const Planes& image, const Planes& reference, int width, Vec2i origin,
                     const MeasureOptions& options) {
  checkSizes(image, reference, options);
  ErrorMetrics metrics;
  const std::vector<std::size_t> pixels = selectPixels(image, reference, options, metrics);
  metrics.pixels = pixels.size();
  metrics.meanRatio = 1;
  if (pixels.empty()) return metrics;

  metrics.meanImage = meanOf(image, pixels);
  metrics.meanReference = meanOf(reference, pixels);
  const double floor = 0.1 * metrics.meanReference;
  double squares = 0, referenceSquares = 0, relative = 0, noise = 0;
  std::size_t worst = pixels[0];
  for (const std::size_t i : pixels)
    for (std::size_t c = 0; c < reference.size(); ++c) {
      const double ref = reference[c][i];
      const double d = image[c][i] - ref;
      const double scale = ref * ref + floor * floor;
      squares += d * d;
      referenceSquares += ref * ref;
      if (d != 0) relative += d * d / scale;
      if (!options.referenceVariance.empty() && scale > 0)
        noise += options.referenceVariance[c][i] / scale;
      if (std::abs(d) > metrics.maxDifference) {
        metrics.maxDifference = std::abs(d);
        worst = i;
      }
    }

  const double count = static_cast<double>(pixels.size()) * static_cast<double>(reference.size());
  metrics.rmse = std::sqrt(squares / count);
  metrics.relMse = relative / count;
  metrics.relativeError = std::sqrt(metrics.relMse);
  metrics.referenceNoise = noise / count;
  metrics.unbiasedRelMse = metrics.relMse - metrics.referenceNoise;
  if (metrics.meanImage != metrics.meanReference)
    metrics.meanRatio = metrics.meanImage / metrics.meanReference;
  if (squares > 0) metrics.relativeL2 = std::sqrt(squares / referenceSquares);
  const auto w = static_cast<std::size_t>(width);
  metrics.worstPixel = origin + Vec2i(static_cast<int>(worst % w), static_cast<int>(worst / w));
  return metrics;
}

double relativeProduct(const Planes& a, const Planes& b, const Planes& reference,
                       std::span<const unsigned char> mask) {
  MeasureOptions options;
  options.mask = mask;
  checkSizes(a, reference, options);
  checkSizes(b, reference, options);
  ErrorMetrics ignored;
  std::vector<std::size_t> pixels = selectPixels(a, reference, options, ignored);
  std::erase_if(pixels, [&](std::size_t i) { return !allFinite(b, i); });
  if (pixels.empty()) return 0;
  const double floor = 0.1 * meanOf(reference, pixels);
  double sum = 0;
  for (const std::size_t i : pixels)
    for (std::size_t c = 0; c < reference.size(); ++c) {
      const double ref = reference[c][i];
      const double product = (a[c][i] - ref) * (b[c][i] - ref);
      if (product != 0) sum += product / (ref * ref + floor * floor);
    }
  return sum / (static_cast<double>(pixels.size()) * static_cast<double>(reference.size()));
}

std::vector<float> varianceOfMean(std::span<const float> a, std::span<const float> b) {
  if (a.size() != b.size()) throw ConfigError("two halves of a reference differ in size");
  std::vector<float> variance(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const float d = a[i] - b[i];
    variance[i] = 0.25f * d * d;
  }
  return variance;
}

std::optional<std::vector<unsigned char>> smokeMask(const Image& reference) {
  constexpr float kEmpty = 0.99f;
  std::vector<unsigned char> mask(reference.pixelCount());
  const Channel* const layer[] = {reference.find("transmittance.R"),
                                  reference.find("transmittance.G"),
                                  reference.find("transmittance.B")};
  const Channel* alpha = reference.find("A");
  if (layer[0] && layer[1] && layer[2]) {
    for (std::size_t i = 0; i < mask.size(); ++i) {
      const Rgb t(layer[0]->pixels[i], layer[1]->pixels[i], layer[2]->pixels[i]);
      mask[i] = meanComponent(t) < kEmpty;
    }
  } else if (alpha) {
    for (std::size_t i = 0; i < mask.size(); ++i)
      mask[i] = 1.0f - alpha->pixels[i] < kEmpty;
  } else {
    return std::nullopt;
  }
  return mask;
}

}  // namespace photosphere::image
