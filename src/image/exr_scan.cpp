#include "exr_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "exr_bytes.h"

namespace photosphere::image {
namespace {

constexpr std::uint32_t kMagic = 20000630;
constexpr std::uint32_t kTiledFlag = 0x200, kDeepFlag = 0x800, kMultiPartFlag = 0x1000;

struct TileDescription {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  int levelMode = 0;  ///< 0 one level, 1 mip map, 2 rip map
  bool roundUp = false;
};

/// What a header holds before it is checked.
struct RawHeader {
  ExrPart part;
  TileDescription tiles;
  std::optional<std::int32_t> statedChunks;
  bool hasChannels = false, hasCompression = false, hasData = false, hasDisplay = false;
  bool hasTiles = false;
};

Window readWindow(ExrBytes& bytes) {
  std::int32_t box[4];
  bytes.read(box, sizeof(box));
  const std::int64_t width = std::int64_t{box[2]} - box[0] + 1;
  const std::int64_t height = std::int64_t{box[3]} - box[1] + 1;
  constexpr std::int64_t limit = std::numeric_limits<std::int32_t>::max();
  if (width < 1 || height < 1 || width > limit || height > limit || width * height > limit)
    bytes.damaged("its header has an empty or impossible window");
  return {box[0], box[1], static_cast<int>(width), static_cast<int>(height)};
}

void readChannels(ExrBytes& bytes, RawHeader& header) {
  while (!bytes.name().empty()) {
    const auto type = bytes.value<std::int32_t>();
    if (type < 0 || type > 2) bytes.damaged("a channel has an unknown type");
    bytes.value<std::uint32_t>();  // perceptually linear flag and padding
    const auto xSampling = bytes.value<std::int32_t>();
    const auto ySampling = bytes.value<std::int32_t>();
    header.part.subsampled |= xSampling != 1 || ySampling != 1;
    header.part.bytesPerPixel += type == 1 ? 2 : 4;
    ++header.part.channelCount;
  }
}

void readAttribute(ExrBytes& bytes, const std::string& name, std::int32_t size, RawHeader& header) {
  if (name == "channels") {
    readChannels(bytes, header);
    header.hasChannels = true;
  } else if (name == "compression" && size == 1) {
    const auto code = bytes.value<std::uint8_t>();
    if (code > static_cast<std::uint8_t>(ExrCode::dwab)) bytes.damaged("unknown compression");
    header.part.compression = static_cast<ExrCode>(code);
    header.hasCompression = true;
  } else if (name == "dataWindow" && size == 16) {
    header.part.data = readWindow(bytes);
    header.hasData = true;
  } else if (name == "displayWindow" && size == 16) {
    header.part.display = readWindow(bytes);
    header.hasDisplay = true;
  } else if (name == "tiles" && size == 9) {
    header.tiles.width = bytes.value<std::uint32_t>();
    header.tiles.height = bytes.value<std::uint32_t>();
    const auto mode = bytes.value<std::uint8_t>();
    header.tiles.levelMode = mode & 15;
    header.tiles.roundUp = (mode >> 4) != 0;
    header.hasTiles = true;
  } else if (name == "chunkCount" && size == 4) {
    header.statedChunks = bytes.value<std::int32_t>();
  } else if (name == "type") {
    std::string type(static_cast<std::size_t>(size), '\0');
    bytes.read(type.data(), type.size());
    header.part.tiled = type == "tiledimage" || type == "deeptile";
    header.part.deep = type == "deepscanline" || type == "deeptile";
  }
}

std::uint64_t linesPerChunk(ExrCode compression) {
  switch (compression) {
    case ExrCode::none:
    case ExrCode::rle:
    case ExrCode::zips:
      return 1;
    case ExrCode::zip:
    case ExrCode::pxr24:
      return 16;
    case ExrCode::piz:
    case ExrCode::b44:
    case ExrCode::b44a:
    case ExrCode::dwaa:
      return 32;
    case ExrCode::dwab:
      return 256;
  }
  return 1;
}

/// Sizes of the levels along one side, full resolution first.
std::vector<std::uint64_t> levelSizes(std::uint64_t size, std::uint64_t longest, bool roundUp) {
  std::vector<std::uint64_t> sizes;
  int count = 1;
  for (std::uint64_t rest = longest; rest > 1; rest = roundUp ? (rest + 1) / 2 : rest / 2)
    ++count;
  for (int level = 0; level < count; ++level) {
    const std::uint64_t step = std::uint64_t{1} << level;
    sizes.push_back(std::max<std::uint64_t>(1, (size + (roundUp ? step - 1 : 0)) / step));
  }
  return sizes;
}

std::uint64_t countTiles(const RawHeader& header) {
  const auto width = static_cast<std::uint64_t>(header.part.data.width);
  const auto height = static_cast<std::uint64_t>(header.part.data.height);
  const auto across = [&](std::uint64_t w) {
    return (w + header.tiles.width - 1) / header.tiles.width;
  };
  const auto down = [&](std::uint64_t h) {
    return (h + header.tiles.height - 1) / header.tiles.height;
  };
  if (header.tiles.levelMode == 0) return across(width) * down(height);
  const bool up = header.tiles.roundUp;
  const std::uint64_t longest = std::max(width, height);
  const bool mip = header.tiles.levelMode == 1;
  const auto widths = levelSizes(width, mip ? longest : width, up);
  const auto heights = levelSizes(height, mip ? longest : height, up);
  std::uint64_t count = 0;
  if (mip) {
    for (std::size_t level = 0; level < widths.size(); ++level)
      count += across(widths[level]) * down(heights[level]);
  } else {
    for (const std::uint64_t w : widths)
      for (const std::uint64_t h : heights)
        count += across(w) * down(h);
  }
  return count;
}

void checkHeader(const ExrBytes& bytes, RawHeader& header, bool multiPart) {
  if (!header.hasChannels || !header.hasCompression || !header.hasData || !header.hasDisplay)
    bytes.damaged("its header lacks channels, compression or a window");
  if (header.part.tiled) {
    if (!header.hasTiles || header.tiles.width < 1 || header.tiles.height < 1 ||
        std::uint64_t{header.tiles.width} * header.tiles.height > 1u << 26 ||
        header.tiles.levelMode > 2)
      bytes.damaged("its tile sizes are missing or impossible");
    header.part.chunkCount = countTiles(header);
    header.part.pixelsPerTile = std::uint64_t{header.tiles.width} * header.tiles.height;
  } else {
    const std::uint64_t lines = linesPerChunk(header.part.compression);
    header.part.chunkCount =
        (static_cast<std::uint64_t>(header.part.data.height) + lines - 1) / lines;
  }
  const bool mustState = multiPart || header.part.deep;
  if ((mustState && !header.statedChunks) ||
      (header.statedChunks &&
       *header.statedChunks != static_cast<std::int64_t>(header.part.chunkCount)))
    bytes.damaged("its chunk count does not match its windows");
}

/// Where strings end, each behind its length, that begin here and should end at `end`.
std::uint64_t endOfStrings(ExrBytes& bytes, std::uint64_t end) {
  std::uint64_t at = bytes.position();
  while (at < end) {
    bytes.seek(at);
    at += 4 + std::uint64_t{bytes.value<std::uint32_t>()};
  }
  return at;
}

/// OpenEXR reads as many bytes as a type takes, or on to where its content ends, whatever size is
/// stated, and what is left would be its next attribute: it would then see another header than this
/// scan.
void checkSize(ExrBytes& bytes, const std::string& name, std::string_view type, std::int32_t size) {
  static constexpr std::pair<std::string_view, std::int32_t> sizes[] = {
      {"box2f", 16},
      {"box2i", 16},
      {"chromaticities", 32},
      {"compression", 1},
      {"deepImageState", 1},
      {"double", 8},
      {"envmap", 1},
      {"float", 4},
      {"int", 4},
      {"keycode", 28},
      {"lineOrder", 1},
      {"m33d", 72},
      {"m33f", 36},
      {"m44d", 128},
      {"m44f", 64},
      {"rational", 8},
      {"tiledesc", 9},
      {"timecode", 8},
      {"v2d", 16},
      {"v2f", 8},
      {"v2i", 8},
      {"v3d", 24},
      {"v3f", 12},
      {"v3i", 12},
  };
  std::int64_t expected = size;
  for (const auto& [known, itsSize] : sizes)
    if (type == known) expected = itsSize;
  const std::uint64_t begin = bytes.position();
  if (type == "preview") {
    const auto width = bytes.value<std::uint32_t>(), height = bytes.value<std::uint32_t>();
    if (width > 1u << 14 || height > 1u << 14) bytes.damaged("its preview has an impossible size");
    expected = 8 + 4 * std::int64_t{width} * std::int64_t{height};
  } else if (type == "chlist") {
    RawHeader unused;
    readChannels(bytes, unused);
    expected = static_cast<std::int64_t>(bytes.position() - begin);
  } else if (type == "stringvector") {
    const std::uint64_t end = begin + static_cast<std::uint64_t>(size);
    expected = static_cast<std::int64_t>(endOfStrings(bytes, end) - begin);
  }
  bytes.seek(begin);
  if (size != expected)
    bytes.damaged(fmt::format("attribute '{}' of type {} has {} bytes", name, type, size));
}

/// One header up to its end mark. @return false for the empty header that ends a multi-part list
bool readHeader(ExrBytes& bytes, RawHeader& header) {
  bool any = false;
  for (std::string name = bytes.name(); !name.empty(); name = bytes.name()) {
    any = true;
    const std::string type = bytes.name();
    const auto size = bytes.value<std::int32_t>();
    if (size < 0 || static_cast<std::uint64_t>(size) > bytes.left()) bytes.cutShort();
    const std::uint64_t end = bytes.position() + static_cast<std::uint64_t>(size);
    checkSize(bytes, name, type, size);
    readAttribute(bytes, name, size, header);
    if (bytes.position() > end || (name == "channels" && bytes.position() != end))
      bytes.damaged(fmt::format("attribute '{}' does not fill its size", name));
    bytes.seek(end);
  }
  return any;
}

/// Checks that the chunk at `offset` is whole.
void checkChunk(ExrBytes& bytes, std::uint64_t offset, const ExrPart& part, bool multiPart) {
  bytes.seek(offset);
  if (multiPart) bytes.value<std::int32_t>();
  const int coordinates = part.tiled ? 4 : 1;
  for (int i = 0; i < coordinates; ++i)
    bytes.value<std::int32_t>();
  std::uint64_t size = 0;
  if (part.deep) {
    const auto table = bytes.value<std::uint64_t>();
    const auto data = bytes.value<std::uint64_t>();
    bytes.value<std::uint64_t>();  // unpacked size
    if (table > bytes.size() || data > bytes.size()) bytes.cutShort();
    size = table + data;
  } else {
    const auto stated = bytes.value<std::int32_t>();
    if (stated < 0) bytes.damaged("a chunk has a negative size");
    size = static_cast<std::uint64_t>(stated);
  }
  if (size > bytes.left()) bytes.cutShort();
}

void checkChunks(ExrBytes& bytes, const ExrScan& scan, bool multiPart) {
  std::uint64_t tableSize = 0;
  for (const ExrPart& part : scan.parts) {
    if (part.chunkCount > bytes.left() / 8) bytes.cutShort();
    tableSize += part.chunkCount * 8;
  }
  if (tableSize > bytes.left()) bytes.cutShort();
  const std::uint64_t firstChunk = bytes.position() + tableSize;
  std::vector<std::vector<std::uint64_t>> tables;
  for (const ExrPart& part : scan.parts) {
    tables.emplace_back(static_cast<std::size_t>(part.chunkCount));
    bytes.read(tables.back().data(), part.chunkCount * 8);
  }
  for (std::size_t i = 0; i < tables.size(); ++i)
    for (const std::uint64_t offset : tables[i]) {
      if (offset == 0) bytes.damaged("chunks are missing, as if its writer had been stopped");
      if (offset < firstChunk || offset >= bytes.size())
        bytes.damaged("a chunk lies outside the file, as if it had been cut short");
      checkChunk(bytes, offset, scan.parts[i], multiPart);
    }
}

}  // namespace

ExrScan scanExr(const std::filesystem::path& path) {
  ExrBytes bytes(path);
  if (bytes.size() < 8 || bytes.value<std::uint32_t>() != kMagic)
    bytes.damaged("it does not start as one");
  const auto version = bytes.value<std::uint32_t>();
  if ((version & 255) != 2) bytes.damaged("unknown version of the format");
  const bool multiPart = (version & kMultiPartFlag) != 0;

  ExrScan scan;
  scan.fileSize = bytes.size();
  while (true) {
    RawHeader header;
    header.part.tiled = (version & kTiledFlag) != 0;
    header.part.deep = (version & kDeepFlag) != 0;
    if (!readHeader(bytes, header)) {
      if (!multiPart || scan.parts.empty()) bytes.damaged("its header is empty");
      break;
    }
    checkHeader(bytes, header, multiPart);
    scan.parts.push_back(header.part);
    if (!multiPart) break;
  }
  checkChunks(bytes, scan, multiPart);
  return scan;
}

}  // namespace photosphere::image
