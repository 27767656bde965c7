#include "photosphere/image/image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <limits>

#include "photosphere/core/error.h"

namespace photosphere::image {
namespace {

constexpr std::string_view kRootLayer = "RGB";

void checkWindow(const Window& window, const char* which) {
  const auto pixels = static_cast<std::int64_t>(window.width) * window.height;
  if (window.width < 1 || window.height < 1 || pixels > std::numeric_limits<std::int32_t>::max())
    throw ConfigError(fmt::format(
        "image: the {} window {}x{} must have from 1 to 2^31 - 1 pixels; choose another "
        "resolution or crop",
        which, window.width, window.height));
}

}  // namespace

Window intersection(const Window& a, const Window& b) {
  // 64 bits: the windows of a file may lie at either end of the integers.
  const auto end = [](int start, int size) { return std::int64_t{start} + size; };
  Window shared{std::max(a.x, b.x), std::max(a.y, b.y), 0, 0};
  const std::int64_t width = std::min(end(a.x, a.width), end(b.x, b.width)) - shared.x;
  const std::int64_t height = std::min(end(a.y, a.height), end(b.y, b.height)) - shared.y;
  if (width <= 0 || height <= 0) return shared;
  shared.width = static_cast<int>(width);
  shared.height = static_cast<int>(height);
  return shared;
}

ChannelKind channelKindFromName(std::string_view name) {
  const std::string_view last = name.substr(name.rfind('.') + 1);  // npos + 1 = 0: the whole name
  return last == "R" || last == "G" || last == "B" || last == "A" ? ChannelKind::color
                                                                  : ChannelKind::data;
}

Image::Image(int width, int height) : Image({0, 0, width, height}, {0, 0, width, height}) {}

Image::Image(const Window& data, const Window& display) : m_data(data), m_display(display) {
  checkWindow(data, "data");
  checkWindow(display, "display");
}

std::span<float> Image::addChannel(const std::string& name) {
  return addChannel(name, channelKindFromName(name));
}

std::span<float> Image::addChannel(const std::string& name, ChannelKind kind) {
  if (name.empty() || has(name))
    throw ConfigError(fmt::format("image: channel name '{}' is {}; give each channel its own name",
                                  name, name.empty() ? "empty" : "taken"));
  m_channels.push_back({name, kind, std::vector<float>(pixelCount())});
  return m_channels.back().pixels;
}

void Image::addLayer(const std::string& layer, ChannelKind kind, std::string_view components) {
  for (const char component : components)
    addChannel(channelName(layer, std::string_view(&component, 1)), kind);
}

const Channel* Image::find(std::string_view name) const {
  for (const Channel& channel : m_channels)
    if (channel.name == name) return &channel;
  return nullptr;
}

std::span<const float> Image::channel(std::string_view name) const {
  if (const Channel* found = find(name)) return found->pixels;
  std::string known;
  for (const Channel& channel : m_channels)
    known += (known.empty() ? "" : ", ") + channel.name;
  throw ConfigError(fmt::format("image: no channel '{}' (it has: {})", name, known));
}

std::span<float> Image::channel(std::string_view name) {
  const std::span<const float> found = static_cast<const Image*>(this)->channel(name);
  return {const_cast<float*>(found.data()), found.size()};
}

std::vector<Layer> Image::layers() const {
  std::vector<Layer> layers;
  std::vector<bool> used(m_channels.size(), false);
  const auto indexOf = [&](const std::string& name) {
    const auto at = std::find_if(m_channels.begin(), m_channels.end(),
                                 [&](const Channel& channel) { return channel.name == name; });
    return static_cast<std::size_t>(at - m_channels.begin());
  };
  for (std::size_t i = 0; i < m_channels.size(); ++i) {
    if (used[i]) continue;
    const std::string& name = m_channels[i].name;
    const std::size_t dot = name.rfind('.');
    const std::string prefix = dot == std::string::npos ? "" : name.substr(0, dot);
    const std::string component = dot == std::string::npos ? name : name.substr(dot + 1);
    if (component == "R" || component == "G" || component == "B") {
      const std::size_t r = indexOf(channelName(prefix, "R"));
      const std::size_t g = indexOf(channelName(prefix, "G"));
      const std::size_t b = indexOf(channelName(prefix, "B"));
      if (r < used.size() && g < used.size() && b < used.size()) {
        used[r] = used[g] = used[b] = true;
        layers.push_back({prefix.empty() ? std::string(kRootLayer) : prefix, {r, g, b}});
        continue;
      }
    }
    layers.push_back({name, {i}});
  }
  return layers;
}

std::string Image::channelName(std::string_view layer, std::string_view component) {
  if (layer.empty() || layer == kRootLayer) return std::string(component);
  return fmt::format("{}.{}", layer, component);
}

Rgb Image::rgb(std::string_view layer, int x, int y) const {
  if (!m_data.contains(x, y)) return Rgb(0.0f);
  const std::size_t i = index(x, y);
  return {channel(channelName(layer, "R"))[i], channel(channelName(layer, "G"))[i],
          channel(channelName(layer, "B"))[i]};
}

void Image::setRgb(std::string_view layer, int x, int y, const Rgb& value) {
  if (!m_data.contains(x, y))
    throw ConfigError(fmt::format("image: pixel ({}, {}) lies outside the data window", x, y));
  const std::size_t i = index(x, y);
  channel(channelName(layer, "R"))[i] = value.x;
  channel(channelName(layer, "G"))[i] = value.y;
  channel(channelName(layer, "B"))[i] = value.z;
}

}  // namespace photosphere::image
