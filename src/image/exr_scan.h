#pragma once
// A walk over an EXR file's bytes that trusts none of them, made before OpenEXR sees the file:
// OpenEXR sizes its buffers by what a header claims, and rebuilds a missing chunk table in silence.

#include <cstdint>
#include <filesystem>
#include <vector>

#include "photosphere/image/image.h"

namespace photosphere::image {

/// Compression codes of the file format, in its order.
enum class ExrCode : std::uint8_t { none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa, dwab };

struct ExrPart {
  Window data;
  Window display;
  ExrCode compression = ExrCode::none;
  bool tiled = false;
  bool deep = false;
  bool subsampled = false;
  int channelCount = 0;
  std::uint64_t bytesPerPixel = 0;  ///< in the file, uncompressed
  std::uint64_t pixelsPerTile = 0;  ///< of a whole tile; 0 for scan lines
  std::uint64_t chunkCount = 0;     ///< over all levels
};

struct ExrScan {
  std::uint64_t fileSize = 0;
  std::vector<ExrPart> parts;
};

/// Reads headers, chunk tables and chunk headers; every size is bounded by the file's.
/// Source: "OpenEXR File Layout", openexr.com.
/// @throws InputMissingError when the file cannot be opened
/// @throws InputError when a header is damaged or a chunk is missing or cut short
ExrScan scanExr(const std::filesystem::path& path);

}  // namespace photosphere::image
