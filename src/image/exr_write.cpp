#include <OpenEXR/Iex.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <fmt/format.h>
#include <half.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "exr_attribute_io.h"
#include "exr_scan.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/core/output_file.h"
#include "photosphere/image/exr.h"

namespace photosphere::image {
namespace {

struct CompressionName {
  std::string_view name;
  ExrCompression value;
  Imf::Compression imf;
};
constexpr std::array<CompressionName, 7> kCompressions{{
    {"none", ExrCompression::none, Imf::NO_COMPRESSION},
    {"rle", ExrCompression::rle, Imf::RLE_COMPRESSION},
    {"zips", ExrCompression::zips, Imf::ZIPS_COMPRESSION},
    {"zip", ExrCompression::zip, Imf::ZIP_COMPRESSION},
    {"piz", ExrCompression::piz, Imf::PIZ_COMPRESSION},
    {"dwaa", ExrCompression::dwaa, Imf::DWAA_COMPRESSION},
    {"dwab", ExrCompression::dwab, Imf::DWAB_COMPRESSION},
}};

/// Writes to a file and remembers the first failure: OpenEXR writes its chunk table in a destructor
/// that swallows exceptions.
class CheckedStream : public Imf::OStream {
 public:
  /// @param error  becomes errno of the first failure
  CheckedStream(const std::string& path, int& error)
      : Imf::OStream(path.c_str()), m_file(std::fopen(path.c_str(), "wb")), m_error(error) {
    if (!m_file) fail();
  }
  ~CheckedStream() override {
    if (m_file) std::fclose(m_file);
  }
  CheckedStream(const CheckedStream&) = delete;
  CheckedStream& operator=(const CheckedStream&) = delete;

  void write(const char bytes[], int count) override {
    const auto size = static_cast<std::size_t>(count);
    if (std::fwrite(bytes, 1, size, m_file) != size) fail();
    m_position += size;
    m_end = std::max(m_end, m_position);
  }
  uint64_t tellp() override { return m_position; }
  void seekp(uint64_t position) override {
    if (fseeko(m_file, static_cast<off_t>(position), SEEK_SET) != 0) fail();
    m_position = position;
  }

  /// Flushes and closes. @return the bytes that the file must now have
  uint64_t close() {
    if (m_error) fail();
    if (std::fflush(m_file) != 0) fail();
    std::FILE* file = m_file;
    m_file = nullptr;
    if (std::fclose(file) != 0) fail();
    return m_end;
  }

 private:
  [[noreturn]] void fail() {
    if (!m_error) m_error = errno ? errno : EIO;
    throw Iex::IoExc(std::string(std::strerror(m_error)));
  }

  std::FILE* m_file;
  uint64_t m_position = 0;
  uint64_t m_end = 0;
  int& m_error;
};

std::string pixelName(const Image& image, const Channel& channel, std::size_t index) {
  const auto width = static_cast<std::size_t>(image.width());
  return fmt::format("channel '{}', pixel ({}, {})", channel.name,
                     image.dataWindow().x + static_cast<int>(index % width),
                     image.dataWindow().y + static_cast<int>(index / width));
}

/// Refuses what must not reach a file. @return true when all colour fits half
bool checkPixels(const std::string& path, const Image& image, bool floatAsked) {
  const Channel* worst = nullptr;
  std::size_t worstIndex = 0;
  float worstValue = HALF_MAX;
  for (const Channel& channel : image.channels())
    for (std::size_t i = 0; i < channel.pixels.size(); ++i) {
      const float value = channel.pixels[i];
      // One comparison passes every ordinary value.
      if (std::abs(value) <= worstValue) continue;
      if (std::isnan(value))
        throw OutputError(path, fmt::format("not written: {} is not a number; render this frame "
                                            "again and report the scene if it persists",
                                            pixelName(image, channel, i)));
      if (channel.kind == ChannelKind::data) continue;
      if (std::isinf(value))
        throw OutputError(path, fmt::format("not written: {} is infinite; look for lights or "
                                            "emission of unbounded strength",
                                            pixelName(image, channel, i)));
      worst = &channel;
      worstIndex = i;
      worstValue = std::abs(value);
    }
  if (!worst) return true;
  if (floatAsked) return false;
  log::warning("{}: {} is {}, above the largest half (65504): colour is written as float", path,
               pixelName(image, *worst, worstIndex), worst->pixels[worstIndex]);
  return false;
}

Imath::Box2i toBox(const Window& w) {
  return {{w.x, w.y}, {w.x + w.width - 1, w.y + w.height - 1}};
}

Imf::Header makeHeader(const Image& image, const ExrAttributes& attributes,
                       const ExrOptions& options, bool halfColor) {
  Imf::Header header(toBox(image.displayWindow()), toBox(image.dataWindow()));
  putAttributes(attributes, header);
  for (const CompressionName& row : kCompressions)
    if (row.value == options.compression) header.compression() = row.imf;
  const bool dwa =
      options.compression == ExrCompression::dwaa || options.compression == ExrCompression::dwab;
  if (dwa) header.dwaCompressionLevel() = options.dwaLevel;
  for (const Channel& channel : image.channels()) {
    const bool isHalf = halfColor && channel.kind == ChannelKind::color;
    header.channels().insert(channel.name, Imf::Channel(isHalf ? Imf::HALF : Imf::FLOAT));
  }
  return header;
}

/// Rows to convert at a time: a multiple of every compression's block of lines.
constexpr int kBandRows = 256;

void writePixels(Imf::OutputFile& file, const Image& image, bool halfColor) {
  const Window& data = image.dataWindow();
  const auto width = static_cast<std::size_t>(data.width);
  std::vector<std::vector<half>> halves(image.channels().size());
  for (int first = 0; first < data.height; first += kBandRows) {
    const int rows = std::min(kBandRows, data.height - first);
    const std::size_t begin = static_cast<std::size_t>(first) * width;
    const std::size_t count = static_cast<std::size_t>(rows) * width;
    const Imath::Box2i band({data.x, data.y + first},
                            {data.x + data.width - 1, data.y + first + rows - 1});
    Imf::FrameBuffer buffer;
    for (std::size_t i = 0; i < halves.size(); ++i) {
      const Channel& channel = image.channels()[i];
      const float* pixels = channel.pixels.data() + begin;
      if (halfColor && channel.kind == ChannelKind::color) {
        halves[i].assign(pixels, pixels + count);
        buffer.insert(channel.name, Imf::Slice::Make(Imf::HALF, halves[i].data(), band));
      } else {
        buffer.insert(channel.name, Imf::Slice::Make(Imf::FLOAT, pixels, band));
      }
    }
    file.setFrameBuffer(buffer);
    file.writePixels(rows);
  }
}

/// Reads back what was written, up to the pixels.
void verify(const OutputFile& output, uint64_t expectedSize) {
  const std::string temporary = output.temporaryPath().string();
  const std::string target = output.target().string();
  try {
    const ExrScan scan = scanExr(temporary);
    Imf::InputFile file(temporary.c_str(), 0);
    if (scan.fileSize == expectedSize && file.isComplete()) return;
  } catch (const std::exception& error) {
    throw OutputError(target, fmt::format("came out damaged ({}); check the disk", error.what()));
  }
  throw OutputError(target, "came out incomplete; check the disk");
}

}  // namespace

ExrCompression parseExrCompression(std::string_view name) {
  std::string known;
  for (const CompressionName& row : kCompressions) {
    if (row.name == name) return row.value;
    known += (known.empty() ? "" : ", ") + std::string(row.name);
  }
  throw ConfigError(fmt::format("unknown EXR compression '{}' (known: {})", name, known));
}

void writeExr(const std::filesystem::path& path, const Image& image,
              const ExrAttributes& attributes, const ExrOptions& options) {
  const std::string name = path.string();
  if (image.channels().empty()) throw OutputError(name, "not written: the image has no channels");
  const bool halfFits = checkPixels(name, image, options.floatColor);
  const bool halfColor = halfFits && !options.floatColor;
  OutputFile output(path);
  uint64_t size = 0;
  int failure = 0;
  try {
    CheckedStream stream(output.temporaryPath().string(), failure);
    {
      Imf::OutputFile file(stream, makeHeader(image, attributes, options, halfColor), 0);
      writePixels(file, image, halfColor);
    }
    size = stream.close();
  } catch (const std::exception& error) {
    // OpenEXR would name the temporary file and no remedy.
    throw OutputError(name, "cannot be written: " + (failure ? describeWriteError(failure)
                                                             : std::string(error.what())));
  }
  if (!output.inPlace()) verify(output, size);
  output.commit();
}

}  // namespace photosphere::image
