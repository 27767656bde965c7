#pragma once
// What is asked of OpenImageIO. It brings 236 libraries with it, which take 0.2 s of processor time
// to load; so a library of its own, photosphere_openimageio.so, links
// them, and is loaded by the first picture that is read or encoded. Most frames have none.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace photosphere::image {

/// What a file says of its picture before its pixels are read.
struct PictureHeader {
  int width = 0, height = 0, depth = 0;
  int channels = 0;
  std::size_t bytesPerPixel = 0;  ///< as stored
  std::string colorSpace;         ///< empty where neither file nor format tells
};

/// How an 8-bit picture is encoded.
struct PictureEncoding {
  const char* format;  ///< a name of OpenImageIO's, such as `png`
  int width, height;
  bool dither = false;      ///< else rounded
  std::string compression;  ///< empty: the format's own
};

/// The functions of the library that is loaded. What they throw is what they are told to, and
/// std::bad_alloc.
struct OpenImageIo {
  /// Reads a picture as float, all channels of a pixel together, rows from the top.
  /// @param check  is shown the header before memory is taken for pixels, and may throw
  /// @param pixels  takes width * height * channels values
  /// @return what is wrong; empty where nothing is
  std::string (*read)(const std::string& path,
                      const std::function<void(const PictureHeader&)>& check, PictureHeader& header,
                      std::vector<float>& pixels);

  /// Encodes r, g, b in [0, 1], row by row from the top.
  /// @param bytes  takes the file
  /// @return what is wrong; empty where nothing is
  std::string (*encode)(const PictureEncoding& encoding, const float* rgb, std::string& bytes);
};

/// The functions, loaded when first asked for.
/// @throws Error when the library is not there: it is installed in `lib/photosphere`
const OpenImageIo& openImageIo();

/// What the library exports under this name, with C linkage.
constexpr const char* kOpenImageIoSymbol = "photosphereOpenImageIo";

}  // namespace photosphere::image
