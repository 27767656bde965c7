// The library that is loaded for pictures: the only source that includes OpenImageIO.

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "openimageio.h"

namespace photosphere::image {
namespace {

std::string read(const std::string& path, const std::function<void(const PictureHeader&)>& check,
                 PictureHeader& header, std::vector<float>& pixels) {
  const auto input = OIIO::ImageInput::open(path);
  if (!input) return "is not a picture that can be read: " + OIIO::geterror();
  const OIIO::ImageSpec& spec = input->spec();
  header = {spec.width,
            spec.height,
            spec.depth,
            spec.nchannels,
            spec.pixel_bytes(true),
            spec.get_string_attribute("oiio:ColorSpace")};
  check(header);
  pixels.resize(static_cast<std::size_t>(spec.image_pixels()) *
                static_cast<std::size_t>(spec.nchannels));
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, pixels.data()))
    return "is damaged: " + input->geterror();
  return {};
}

std::string encode(const PictureEncoding& encoding, const float* rgb, std::string& bytes) {
  // To memory: this library's writers report a full disk late or never.
  OIIO::Filesystem::IOVecOutput memory;
  const auto output = OIIO::ImageOutput::create(encoding.format, &memory);
  if (!output) return OIIO::geterror();
  OIIO::ImageSpec spec(encoding.width, encoding.height, 3, OIIO::TypeDesc::UINT8);
  if (encoding.dither) spec.attribute("oiio:dither", 1);
  if (!encoding.compression.empty()) spec.attribute("Compression", encoding.compression);
  if (!output->open(std::string("picture.") + encoding.format, spec) ||
      !output->write_image(OIIO::TypeDesc::FLOAT, rgb) || !output->close())
    return output->geterror();
  const std::vector<unsigned char>& written = memory.buffer();
  bytes.assign(written.begin(), written.end());
  return {};
}

}  // namespace
}  // namespace photosphere::image

extern "C" __attribute__((visibility("default")))
const photosphere::image::OpenImageIo photosphereOpenImageIo{photosphere::image::read,
                                                             photosphere::image::encode};
