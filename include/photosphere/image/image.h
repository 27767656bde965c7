#pragma once
// Pixels in memory: named float channels over a data window inside a display window.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "photosphere/core/types.h"

namespace photosphere::image {

/// A rectangle of pixels: `width` x `height` with its first pixel at (x, y); y grows downwards.
struct Window {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;

  bool contains(int px, int py) const {
    return px >= x && py >= y && px - x < width && py - y < height;
  }
  bool operator==(const Window&) const = default;
};

/// The part that two windows share; width and height 0 when there is none.
Window intersection(const Window& a, const Window& b);

/// What a channel holds decides how a file stores it: colour may become half, data stays float.
enum class ChannelKind { color, data };

/// Colour when the last part of the name is R, G, B or A, else data.
ChannelKind channelKindFromName(std::string_view name);

/// One plane of pixels, rows from the top, `dataWindow().width` floats each.
struct Channel {
  std::string name;  ///< `R`, `Z`, `single.R`
  ChannelKind kind = ChannelKind::color;
  std::vector<float> pixels;
};

/// Channels measured or shown together: R, G, B of one layer, or any other channel alone.
struct Layer {
  std::string name;                   ///< `RGB` for the unnamed layer, `single`, `Z`
  std::vector<std::size_t> channels;  ///< indices into Image::channels(): 3 (R, G, B) or 1
};

/// An image with value semantics. Colour is premultiplied and linear in the rendering space unless
/// whoever made it says otherwise. Const member functions may run in several threads at once.
class Image {
 public:
  Image() = default;
  /// No channels; data window = display window = (0, 0, width, height).
  Image(int width, int height);
  /// A crop: pixels exist in `data` alone.
  /// @throws ConfigError when a window is empty or larger than 2^31 - 1 pixels
  Image(const Window& data, const Window& display);

  int width() const { return m_data.width; }
  int height() const { return m_data.height; }
  const Window& dataWindow() const { return m_data; }
  const Window& displayWindow() const { return m_display; }
  std::size_t pixelCount() const {
    return static_cast<std::size_t>(m_data.width) * static_cast<std::size_t>(m_data.height);
  }
  /// Where pixel (x, y) of the display window's coordinates lies in every channel's `pixels`.
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y - m_data.y) * static_cast<std::size_t>(m_data.width) +
           static_cast<std::size_t>(x - m_data.x);
  }

  /// Adds a channel of zeros. @return its pixels, valid until the next channel is added
  /// @throws ConfigError when the name is empty or taken
  std::span<float> addChannel(const std::string& name);
  std::span<float> addChannel(const std::string& name, ChannelKind kind);
  /// Adds one channel per letter of `components`: `single` and `RGB` give `single.R`...; an empty
  /// layer name gives plain letters.
  void addLayer(const std::string& layer, ChannelKind kind, std::string_view components = "RGB");

  const std::vector<Channel>& channels() const { return m_channels; }
  bool has(std::string_view name) const { return find(name) != nullptr; }
  /// The channel of that name, or null.
  const Channel* find(std::string_view name) const;
  /// Pixels of a channel. @throws ConfigError that lists the channels
  std::span<const float> channel(std::string_view name) const;
  std::span<float> channel(std::string_view name);

  /// R, G, B triples first found first, every other channel alone.
  std::vector<Layer> layers() const;
  /// The channel name of one component: `R` for layer "" or "RGB", `single.R` for "single".
  static std::string channelName(std::string_view layer, std::string_view component);

  /// Colour of pixel (x, y) of a layer; 0 outside the data window. For tests and small reads: it
  /// looks channels up by name.
  Rgb rgb(std::string_view layer, int x, int y) const;
  void setRgb(std::string_view layer, int x, int y, const Rgb& value);

 private:
  Window m_data;
  Window m_display;
  std::vector<Channel> m_channels;
};

}  // namespace photosphere::image
