#pragma once
// Flat OpenEXR files, written whole or not at all and read with suspicion.

#include <filesystem>

#include "photosphere/image/exr_attributes.h"
#include "photosphere/image/image.h"

namespace photosphere::image {

enum class ExrCompression { none, rle, zips, zip, piz, dwaa, dwab };

/// The compression of that name. @throws ConfigError that lists the names
ExrCompression parseExrCompression(std::string_view name);

struct ExrOptions {
  ExrCompression compression = ExrCompression::zip;
  float dwaLevel = 45.0f;   ///< for dwaa and dwab; larger is smaller and worse
  bool floatColor = false;  ///< colour channels as float; else half where every value fits
};

/// Writes a scanline file through core's OutputFile: temporary, checked, then renamed.
/// Colour channels become half. Where one would overflow half (65504), all colour of this frame is
/// written as float, with a warning. Data channels are float, and may hold infinities.
/// @throws OutputError for a NaN anywhere or an infinite colour (says channel and pixel), for a
///         device that is full, and for whatever else stops the file; nothing is left behind
void writeExr(const std::filesystem::path& path, const Image& image,
              const ExrAttributes& attributes = {}, const ExrOptions& options = {});

struct ExrFile {
  Image image;               ///< channels in the file's order; half ones of kind colour
  ExrAttributes attributes;  ///< those of the types above; others are left out
};

/// Reads a single-part flat file, scanlines or tiles (the full-resolution level of a mip map).
/// @throws InputMissingError when it cannot be opened
/// @throws InputError when it is damaged, cut short, deep, multi-part, or has subsampled channels
ExrFile readExr(const std::filesystem::path& path);

/// True for an EXR, flat or deep, whose header, chunk table and chunks are all there. Pixels are
/// not decompressed. False for everything else; never throws for what a file holds.
bool exrIsComplete(const std::filesystem::path& path);

}  // namespace photosphere::image
