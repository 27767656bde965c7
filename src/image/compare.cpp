#include <fmt/format.h>

#include <algorithm>

#include "photosphere/core/error.h"
#include "photosphere/image/metrics.h"

namespace photosphere::image {
namespace {

/// What `Z` holds where a pixel met nothing (render::kNoDepth).
constexpr float kFarDepth = 1e10f;

bool isDepth(const std::string& channel) {
  return channel == "Z" || channel.ends_with(".Z");
}

/// 0 where both depths are those of nothing: that they agree there says nothing of the others, and
/// their size would drown them in every mean.
std::vector<unsigned char> depthMask(std::span<const float> a, std::span<const float> b) {
  std::vector<unsigned char> mask(a.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    mask[i] = !(a[i] >= kFarDepth && b[i] >= kFarDepth);
  return mask;
}

std::string describe(const Window& w) {
  return fmt::format("{}x{} at ({}, {})", w.width, w.height, w.x, w.y);
}

void requireSame(const Window& image, const Window& reference, const char* which) {
  if (image == reference) return;
  throw ConfigError(fmt::format("images to compare differ in their {} windows: {} against {}",
                                which, describe(image), describe(reference)));
}

/// The pixels of a window as an image of its own.
Image cut(const Image& image, const Window& window) {
  Image part(window, image.displayWindow());
  for (const Channel& channel : image.channels()) {
    const std::span<float> out = part.addChannel(channel.name, channel.kind);
    for (int y = window.y; y < window.y + window.height; ++y) {
      const float* row = channel.pixels.data() + image.index(window.x, y);
      std::copy(row, row + window.width, out.data() + part.index(window.x, y));
    }
  }
  return part;
}

Image meanOfBoth(const Image& a, const Image& b) {
  Image mean = a;
  for (const Channel& channel : a.channels()) {
    const Channel* other = b.find(channel.name);
    if (!other) continue;
    const std::span<float> out = mean.channel(channel.name);
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = 0.5f * (channel.pixels[i] + other->pixels[i]);
  }
  return mean;
}

class Comparer {
 public:
  Comparer(const Image& image, const Image& reference, const CompareOptions& options)
      : m_image(image), m_reference(reference) {
    if (options.secondReference) {
      m_second = options.secondReference;
      m_mean = meanOfBoth(reference, *m_second);
    }
    m_mask = smokeMask(target());
  }

  /// @return nothing when the image lacks a channel of this layer
  std::optional<LayerComparison> compare(const Layer& layer) const {
    std::vector<std::span<const float>> image, reference;
    std::vector<std::vector<float>> variance;
    for (const std::size_t index : layer.channels) {
      const std::string& name = m_reference.channels()[index].name;
      const Channel* channel = m_image.find(name);
      if (!channel) return std::nullopt;
      image.emplace_back(channel->pixels);
      reference.emplace_back(target().channels()[index].pixels);
      const Channel* second = m_second ? m_second->find(name) : nullptr;
      if (second)
        variance.push_back(varianceOfMean(m_reference.channels()[index].pixels, second->pixels));
    }
    MeasureOptions options;
    if (variance.size() == layer.channels.size())
      for (const auto& plane : variance)
        options.referenceVariance.emplace_back(plane);
    std::vector<unsigned char> met;
    if (image.size() == 1 && isDepth(m_reference.channels()[layer.channels[0]].name)) {
      met = depthMask(image[0], reference[0]);
      options.mask = met;
    }
    LayerComparison result;
    result.layer = layer.name;
    result.all = measure(image, reference, m_image.width(), origin(), options);
    if (m_mask && layer.channels.size() == 3) {
      options.mask = *m_mask;
      result.smokeOnly = measure(image, reference, m_image.width(), origin(), options);
    }
    return result;
  }

 private:
  const Image& target() const { return m_second ? m_mean : m_reference; }
  Vec2i origin() const { return {m_image.dataWindow().x, m_image.dataWindow().y}; }

  const Image& m_image;
  const Image& m_reference;
  const Image* m_second = nullptr;
  Image m_mean;
  std::optional<std::vector<unsigned char>> m_mask;
};

ImageComparison compareSameWindow(const Image& image, const Image& reference,
                                  const CompareOptions& options) {
  ImageComparison result;
  result.window = reference.dataWindow();
  const Comparer comparer(image, reference, options);
  for (const Layer& layer : reference.layers())
    if (auto compared = comparer.compare(layer)) result.layers.push_back(std::move(*compared));
  for (const Channel& channel : image.channels())
    if (!reference.has(channel.name)) result.onlyInImage.push_back(channel.name);
  for (const Channel& channel : reference.channels())
    if (!image.has(channel.name)) result.onlyInReference.push_back(channel.name);
  if (result.layers.empty()) throw ConfigError("images to compare have no layer in common");
  return result;
}

}  // namespace

ImageComparison compareImages(const Image& image, const Image& reference,
                              const CompareOptions& options) {
  requireSame(image.displayWindow(), reference.displayWindow(), "display");
  if (options.secondReference) {
    requireSame(options.secondReference->displayWindow(), reference.displayWindow(), "display");
    requireSame(options.secondReference->dataWindow(), reference.dataWindow(), "data");
  }
  if (image.dataWindow() == reference.dataWindow())
    return compareSameWindow(image, reference, options);
  if (!options.allowCrop) requireSame(image.dataWindow(), reference.dataWindow(), "data");
  const Window shared = intersection(image.dataWindow(), reference.dataWindow());
  if (shared.width == 0) throw ConfigError("images to compare do not overlap");
  CompareOptions cropped = options;
  Image second;
  if (options.secondReference) {
    second = cut(*options.secondReference, shared);
    cropped.secondReference = &second;
  }
  return compareSameWindow(cut(image, shared), cut(reference, shared), cropped);
}

}  // namespace photosphere::image
