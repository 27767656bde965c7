// EXR files as other software lays them out: tiles, mip maps, parts, deep samples, subsampling.

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "photosphere/core/error.h"
#include "photosphere/image/exr.h"
#include "support/support.h"

namespace photosphere::image {
namespace {

using test::TemporaryFolder;

constexpr int kWidth = 45, kHeight = 23;
const Imath::Box2i kBox({3, -2}, {3 + kWidth - 1, -2 + kHeight - 1});

std::vector<float> ramp() {
  std::vector<float> pixels(kWidth * kHeight);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = static_cast<float>(i) / 7.0f;
  return pixels;
}

Imf::Header header(Imf::Compression compression = Imf::ZIP_COMPRESSION) {
  Imf::Header result(kBox, kBox);
  result.compression() = compression;
  result.channels().insert("Z", Imf::Channel(Imf::FLOAT));
  return result;
}

Imf::FrameBuffer bufferOf(const std::vector<float>& pixels) {
  Imf::FrameBuffer buffer;
  buffer.insert("Z", Imf::Slice::Make(Imf::FLOAT, pixels.data(), kBox));
  return buffer;
}

/// Whole it is complete; without its last byte it is not.
void expectCompleteThenCut(const std::filesystem::path& path) {
  EXPECT_TRUE(exrIsComplete(path));
  const std::string whole = test::readText(path);
  const std::filesystem::path cut = path.string() + ".cut";
  test::writeText(cut, whole.substr(0, whole.size() - 1));
  EXPECT_FALSE(exrIsComplete(cut));
  EXPECT_THROW(readExr(cut), InputError);
}

class ForeignTiles
    : public ::testing::TestWithParam<std::pair<Imf::LevelMode, Imf::LevelRoundingMode>> {};

TEST_P(ForeignTiles, fullResolutionIsRead) {
  const TemporaryFolder folder;
  const auto [mode, rounding] = GetParam();
  const std::vector<float> pixels = ramp();
  {
    Imf::Header tiled = header();
    tiled.setTileDescription(Imf::TileDescription(16, 8, mode, rounding));
    Imf::TiledOutputFile file((folder / "a.exr").c_str(), tiled, 0);
    file.setFrameBuffer(bufferOf(pixels));
    for (int ly = 0; ly < file.numYLevels(); ++ly)
      for (int lx = 0; lx < file.numXLevels(); ++lx)
        if (file.isValidLevel(lx, ly))
          file.writeTiles(0, file.numXTiles(lx) - 1, 0, file.numYTiles(ly) - 1, lx, ly);
  }
  const Image image = readExr(folder / "a.exr").image;
  EXPECT_EQ(image.dataWindow(), (Window{3, -2, kWidth, kHeight}));
  EXPECT_EQ(image.find("Z")->pixels, pixels);
  expectCompleteThenCut(folder / "a.exr");
}

INSTANTIATE_TEST_SUITE_P(Levels, ForeignTiles,
                         ::testing::Values(std::pair(Imf::ONE_LEVEL, Imf::ROUND_DOWN),
                                           std::pair(Imf::MIPMAP_LEVELS, Imf::ROUND_DOWN),
                                           std::pair(Imf::MIPMAP_LEVELS, Imf::ROUND_UP),
                                           std::pair(Imf::RIPMAP_LEVELS, Imf::ROUND_DOWN),
                                           std::pair(Imf::RIPMAP_LEVELS, Imf::ROUND_UP)));

// OpenEXR makes room for whole tiles: 4 GiB for one pixel of 16 channels.
TEST(ForeignExr, aTileThatThePictureCannotNeedIsRefused) {
  const TemporaryFolder folder;
  const auto refusal = [&](int tile) -> std::string {
    Imf::Header tiled(1, 1);
    tiled.compression() = Imf::NO_COMPRESSION;
    tiled.setTileDescription(Imf::TileDescription(64, 64));
    for (char c = 'A'; c < 'A' + 16; ++c)
      tiled.channels().insert(std::string(1, c), Imf::Channel(Imf::FLOAT));
    {
      const float value = 1;
      Imf::FrameBuffer buffer;
      for (char c = 'A'; c < 'A' + 16; ++c)
        buffer.insert(std::string(1, c),
                      Imf::Slice::Make(Imf::FLOAT, &value, Imath::Box2i({0, 0}, {0, 0})));
      Imf::TiledOutputFile file((folder / "a.exr").c_str(), tiled, 0);
      file.setFrameBuffer(buffer);
      file.writeTile(0, 0);
    }
    std::string bytes = test::readText(folder / "a.exr");
    const std::size_t sizes = bytes.find("tiledesc") + 9 + 4;
    for (const std::size_t place : {sizes, sizes + 4})
      std::memcpy(bytes.data() + place, &tile, sizeof tile);
    test::writeText(folder / "a.exr", bytes);
    try {
      readExr(folder / "a.exr");
    } catch (const InputError& error) {
      return error.what();
    }
    return "read";
  };
  EXPECT_EQ(refusal(64), "read");
  EXPECT_EQ(refusal(256), "read");
  EXPECT_NE(refusal(8192).find("claims tiles of 67108864 pixels"), std::string::npos);
}

class ForeignCompressions : public ::testing::TestWithParam<Imf::Compression> {};

TEST_P(ForeignCompressions, flatPicturesAreNotTakenForDamage) {
  // A black picture compresses best: the bound on what a file can claim must let it pass.
  const TemporaryFolder folder;
  const Imath::Box2i box({0, 0}, {1999, 999});
  {
    Imf::Header black(box, box);
    black.compression() = GetParam();
    for (const char* name : {"R", "G", "B"})
      black.channels().insert(name, Imf::Channel(Imf::HALF));
    const std::vector<half> zeros(2000 * 1000);
    Imf::FrameBuffer buffer;
    for (const char* name : {"R", "G", "B"})
      buffer.insert(name, Imf::Slice::Make(Imf::HALF, zeros.data(), box));
    Imf::OutputFile file((folder / "a.exr").c_str(), black, 0);
    file.setFrameBuffer(buffer);
    file.writePixels(1000);
  }
  EXPECT_EQ(readExr(folder / "a.exr").image.rgb("", 1999, 999), Rgb(0.0f));
}

INSTANTIATE_TEST_SUITE_P(All, ForeignCompressions,
                         ::testing::Values(Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION,
                                           Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,
                                           Imf::PIZ_COMPRESSION, Imf::PXR24_COMPRESSION,
                                           Imf::B44_COMPRESSION, Imf::B44A_COMPRESSION,
                                           Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION));

TEST(ForeignExr, partsAreCheckedButNotRead) {
  const TemporaryFolder folder;
  const std::vector<float> pixels = ramp();
  {
    std::vector<Imf::Header> headers{header(), header(Imf::PIZ_COMPRESSION)};
    headers[0].setName("left");
    headers[1].setName("right");
    for (Imf::Header& one : headers)
      one.setType(Imf::SCANLINEIMAGE);
    Imf::MultiPartOutputFile file((folder / "a.exr").c_str(), headers.data(), 2);
    for (int part = 0; part < 2; ++part) {
      Imf::OutputPart output(file, part);
      output.setFrameBuffer(bufferOf(pixels));
      output.writePixels(kHeight);
    }
  }
  try {
    readExr(folder / "a.exr");
    FAIL() << "read";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("multi-part"), std::string::npos) << error.what();
  }
  expectCompleteThenCut(folder / "a.exr");
}

TEST(ForeignExr, deepIsCheckedButNotRead) {
  const TemporaryFolder folder;
  {
    Imf::Header deep = header(Imf::ZIPS_COMPRESSION);
    deep.setType(Imf::DEEPSCANLINE);
    std::vector<unsigned> counts(kWidth * kHeight);
    std::vector<float> samples(kWidth * kHeight, 2.0f);
    std::vector<float*> pointers(counts.size());
    for (std::size_t i = 0; i < counts.size(); ++i) {
      counts[i] = i % 2;
      pointers[i] = &samples[i];
    }
    const std::ptrdiff_t first = kBox.min.x + std::ptrdiff_t{kBox.min.y} * kWidth;
    Imf::DeepFrameBuffer buffer;
    buffer.insertSampleCountSlice(Imf::Slice(Imf::UINT,
                                             reinterpret_cast<char*>(counts.data() - first),
                                             sizeof(unsigned), sizeof(unsigned) * kWidth));
    buffer.insert("Z", Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(pointers.data() - first),
                                      sizeof(float*), sizeof(float*) * kWidth, sizeof(float)));
    Imf::DeepScanLineOutputFile file((folder / "a.exr").c_str(), deep, 0);
    file.setFrameBuffer(buffer);
    file.writePixels(kHeight);
  }
  try {
    readExr(folder / "a.exr");
    FAIL() << "read";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("deep"), std::string::npos) << error.what();
  }
  expectCompleteThenCut(folder / "a.exr");
}

TEST(ForeignExr, subsampledChannelsAreRefused) {
  const TemporaryFolder folder;
  const Imath::Box2i box({0, 0}, {7, 7});
  {
    Imf::Header chroma(box, box);
    chroma.channels().insert("RY", Imf::Channel(Imf::HALF, 2, 2));
    const std::vector<half> zeros(16);
    Imf::FrameBuffer buffer;
    buffer.insert("RY", Imf::Slice::Make(Imf::HALF, zeros.data(), box, 0, 0, 2, 2));
    Imf::OutputFile file((folder / "a.exr").c_str(), chroma, 0);
    file.setFrameBuffer(buffer);
    file.writePixels(8);
  }
  EXPECT_TRUE(exrIsComplete(folder / "a.exr"));
  EXPECT_THROW(readExr(folder / "a.exr"), InputError);
}

}  // namespace
}  // namespace photosphere::image
