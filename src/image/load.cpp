#include "photosphere/image/load.h"

#include <fmt/format.h>

#include <fstream>

#include "openimageio.h"
#include "photosphere/core/error.h"
#include "photosphere/core/input_file.h"
#include "photosphere/core/resources.h"
#include "photosphere/image/exr.h"

namespace photosphere::image {
namespace {

constexpr std::uint32_t kExrMagic = 20000630;

/// Flat regions compress best in deflate, at 1032 to 1; a file that claims much more is damaged.
constexpr std::uint64_t kLargestRatio = 2000;

bool isExr(const std::string& name) {
  std::uint32_t magic = 0;
  std::ifstream in(name, std::ios::binary);
  in.read(reinterpret_cast<char*>(&magic), sizeof(magic));
  return magic == kExrMagic;
}

LoadedImage fromExr(const std::string& name) {
  ExrFile file = readExr(name);
  const char* const sources[] = {"R", "G", "B"};
  const bool grey = !file.image.has("R") && file.image.has("Y");
  LoadedImage loaded{Image(file.image.dataWindow(), file.image.displayWindow()), "linear"};
  for (const char* source : sources) {
    const Channel* channel = file.image.find(grey ? "Y" : source);
    if (!channel)
      throw InputError(name, fmt::format("has no channel {}; save it with R, G and B", source));
    const std::span<float> pixels = loaded.image.addChannel(source, ChannelKind::color);
    std::copy(channel->pixels.begin(), channel->pixels.end(), pixels.begin());
  }
  return loaded;
}

void checkHeader(const std::string& name, const PictureHeader& header, std::uint64_t fileSize) {
  if (header.width < 1 || header.height < 1 || header.channels < 1 || header.depth > 1)
    throw InputError(name, "holds no flat picture");
  const auto pixels =
      static_cast<std::uint64_t>(header.width) * static_cast<std::uint64_t>(header.height);
  if (pixels * header.bytesPerPixel / kLargestRatio > fileSize)
    throw InputError(name, fmt::format("claims {}x{} pixels, more than {} bytes can hold",
                                       header.width, header.height, fileSize));
  const std::uint64_t needed = pixels * 4 * (static_cast<std::uint64_t>(header.channels) + 3);
  if (needed > availableMemoryBytes())
    throw MemoryError(fmt::format("{}: its pixels need {}, but {} of memory are free", name,
                                  formatBytes(needed), formatBytes(availableMemoryBytes())));
}

LoadedImage fromOther(const std::string& name, std::uint64_t fileSize) {
  PictureHeader header;
  std::vector<float> pixels;
  const std::string wrong = openImageIo().read(
      name, [&](const PictureHeader& found) { checkHeader(name, found, fileSize); }, header,
      pixels);
  if (!wrong.empty()) throw InputError(name, wrong);

  const auto channels = static_cast<std::size_t>(header.channels);
  LoadedImage loaded{Image(header.width, header.height), header.colorSpace};
  for (std::size_t c = 0; c < 3; ++c) {
    const std::span<float> plane = loaded.image.addChannel(std::string(1, "RGB"[c]));
    const std::size_t source = channels >= 3 ? c : 0;  // grey, or grey and alpha
    for (std::size_t i = 0; i < plane.size(); ++i)
      plane[i] = pixels[i * channels + source];
  }
  return loaded;
}

}  // namespace

LoadedImage loadImage(const std::filesystem::path& path) {
  const std::string name = path.string();
  const std::uint64_t fileSize = readableSize(name, "a picture");
  // Our own reader checks more.
  if (isExr(name)) return fromExr(name);
  try {
    return fromOther(name, fileSize);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError(name, fmt::format("is damaged: {}; write or copy it again", error.what()));
  }
}

}  // namespace photosphere::image
