#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputFile.h>
#include <fmt/format.h>

#include "exr_attribute_io.h"
#include "exr_scan.h"
#include "photosphere/core/error.h"
#include "photosphere/core/resources.h"
#include "photosphere/image/exr.h"

namespace photosphere::image {
namespace {

constexpr std::uint64_t kSmallTile = std::uint64_t{16} << 20;  // [bytes]

/// Most bytes of pixels that one byte of such a file can stand for; a file that claims more is
/// damaged. ZIP: deflate's 1032. PXR24 first drops a quarter of a float. RLE: 128 bytes in 2. PIZ:
/// Huffman runs of 256 16-bit words in 10 bits. DWA: 64 pixels in one coefficient, then deflate.
std::uint64_t largestRatio(ExrCode compression) {
  switch (compression) {
    case ExrCode::none:
      return 1;
    case ExrCode::rle:
      return 64;
    case ExrCode::b44:
    case ExrCode::b44a:
      return 11;
    case ExrCode::piz:
      return 512;
    case ExrCode::zips:
    case ExrCode::zip:
      return 1040;
    case ExrCode::pxr24:
      return 1400;
    case ExrCode::dwaa:
    case ExrCode::dwab:
      return 67000;
  }
  return 1;
}

void checkReadable(const std::string& path, const ExrScan& scan) {
  if (scan.parts.size() != 1)
    throw InputError(path, "is a multi-part EXR; save the part you need as a file of its own");
  const ExrPart& part = scan.parts[0];
  if (part.deep) throw InputError(path, "is a deep EXR; flatten it first");
  if (part.subsampled)
    throw InputError(path, "has subsampled channels; save it with full resolution in each");
  if (part.channelCount == 0) throw InputError(path, "has no channels");
  const auto pixels =
      static_cast<std::uint64_t>(part.data.width) * static_cast<std::uint64_t>(part.data.height);
  if (pixels * part.bytesPerPixel / largestRatio(part.compression) > scan.fileSize)
    throw InputError(path, fmt::format("claims {}x{} pixels, more than {} bytes can hold",
                                       part.data.width, part.data.height, scan.fileSize));
  // OpenEXR makes room for whole tiles, however little of one the window shows.
  if (part.pixelsPerTile * part.bytesPerPixel > kSmallTile && part.pixelsPerTile > 4 * pixels)
    throw InputError(path,
                     fmt::format("claims tiles of {} pixels for a picture of {}x{}: the header "
                                 "is damaged; write it again",
                                 part.pixelsPerTile, part.data.width, part.data.height));
  const std::uint64_t needed = pixels * 4 * static_cast<std::uint64_t>(part.channelCount);
  if (needed > availableMemoryBytes())
    throw MemoryError(fmt::format("{}: its pixels need {}, but {} of memory are free", path,
                                  formatBytes(needed), formatBytes(availableMemoryBytes())));
}

/// Every bound was set by what the scan saw.
void checkSameHeader(const std::string& path, const ExrPart& part, const Imf::Header& header) {
  const Imath::Box2i& box = header.dataWindow();
  int channels = 0;
  bool same = box.min == Imath::V2i(part.data.x, part.data.y) &&
              box.size() == Imath::V2i(part.data.width - 1, part.data.height - 1) &&
              static_cast<int>(header.compression()) == static_cast<int>(part.compression) &&
              header.hasTileDescription() == part.tiled;
  for (auto at = header.channels().begin(); at != header.channels().end(); ++at)
    ++channels;
  same = same && channels == part.channelCount;
  if (!same) throw InputError(path, "is damaged: its header can be read in two ways");
}

ExrFile readPixels(const std::string& path, const ExrPart& part) {
  Imf::InputFile file(path.c_str(), 0);
  const Imf::Header& header = file.header();
  const Imath::Box2i& box = header.dataWindow();
  checkSameHeader(path, part, header);
  ExrFile result{Image(part.data, part.display), getAttributes(header)};
  for (auto at = header.channels().begin(); at != header.channels().end(); ++at) {
    const bool isHalf = at.channel().type == Imf::HALF;
    result.image.addChannel(at.name(),
                            isHalf ? ChannelKind::color : channelKindFromName(at.name()));
  }
  // After all are there: adding a channel moves the earlier ones.
  Imf::FrameBuffer buffer;
  for (const Channel& channel : result.image.channels())
    buffer.insert(channel.name,
                  Imf::Slice::Make(Imf::FLOAT, result.image.channel(channel.name).data(), box));
  file.setFrameBuffer(buffer);
  file.readPixels(box.min.y, box.max.y);
  return result;
}

}  // namespace

ExrFile readExr(const std::filesystem::path& path) {
  const std::string name = path.string();
  const ExrScan scan = scanExr(path);
  checkReadable(name, scan);
  try {
    return readPixels(name, scan.parts[0]);
  } catch (const Error& error) {
    throw InputError(name, error.what());
  } catch (const std::exception& error) {
    throw InputError(name, fmt::format("is damaged: {}; write or copy it again", error.what()));
  }
}

bool exrIsComplete(const std::filesystem::path& path) {
  try {
    scanExr(path);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace photosphere::image
