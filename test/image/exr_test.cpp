// EXR files: what is stored, what is refused, and that nothing torn is left behind.

#include "photosphere/image/exr.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <limits>

#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "support/support.h"

namespace photosphere::image {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Every pixel different, all exact in half.
Image makeImage(int width = 37, int height = 29) {
  Image image(width, height);
  image.addLayer("", ChannelKind::color, "RGBA");
  image.addLayer("single", ChannelKind::color, "RGB");
  image.addChannel("Z");
  for (const Channel& channel : image.channels()) {
    const std::span<float> pixels = image.channel(channel.name);
    const float offset = static_cast<float>(channel.name.size() * 8 + channel.name.back() % 8);
    for (std::size_t i = 0; i < pixels.size(); ++i)
      pixels[i] = offset + 0.5f * static_cast<float>(i % 1000);
  }
  return image;
}

void expectSamePixels(const Image& a, const Image& b) {
  EXPECT_EQ(a.dataWindow(), b.dataWindow());
  EXPECT_EQ(a.displayWindow(), b.displayWindow());
  ASSERT_EQ(a.channels().size(), b.channels().size());
  for (const Channel& channel : a.channels()) {
    ASSERT_TRUE(b.has(channel.name)) << channel.name;
    EXPECT_EQ(channel.pixels, b.find(channel.name)->pixels) << channel.name;
  }
}

std::vector<std::string> filesIn(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  return names;
}

class ExrCompressions : public ::testing::TestWithParam<const char*> {};

TEST_P(ExrCompressions, roundTripOfPixels) {
  const TemporaryFolder folder;
  // More rows than one band of conversion and than one block of DWAB.
  const Image image = makeImage(19, 300);
  ExrOptions options{.compression = parseExrCompression(GetParam())};
  writeExr(folder / "a.exr", image, {}, options);
  const ExrFile file = readExr(folder / "a.exr");
  if (std::string_view(GetParam()).substr(0, 3) != "dwa") {
    expectSamePixels(image, file.image);
  } else {
    // Lossy for colour, lossless for data.
    EXPECT_EQ(image.find("Z")->pixels, file.image.find("Z")->pixels);
    EXPECT_NEAR(file.image.rgb("single", 7, 280).x, image.rgb("single", 7, 280).x, 5.0f);
  }
  EXPECT_TRUE(exrIsComplete(folder / "a.exr"));
  EXPECT_EQ(filesIn(folder.path()), std::vector<std::string>{"a.exr"});
}

INSTANTIATE_TEST_SUITE_P(All, ExrCompressions,
                         ::testing::Values("none", "rle", "zips", "zip", "piz", "dwaa", "dwab"));

TEST(Exr, unknownCompressionListsTheKnown) {
  try {
    parseExrCompression("zipp");
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("zips"), std::string::npos);
  }
}

TEST(Exr, colorIsHalfAndDataIsFloat) {
  const TemporaryFolder folder;
  Image image(2, 1);
  image.addLayer("", ChannelKind::color);
  image.addChannel("Z");
  const float third = 1.0f / 3.0f;
  image.channel("R")[0] = third;
  image.channel("Z")[0] = third;
  image.channel("Z")[1] = kInfinity;  // nothing hit
  writeExr(folder / "half.exr", image);
  const Image half = readExr(folder / "half.exr").image;
  // Nearest half to 1/3: 1365 / 4096.
  EXPECT_EQ(half.channel("R")[0], 1365.0f / 4096.0f);
  EXPECT_EQ(half.channel("Z")[0], third);
  EXPECT_EQ(half.channel("Z")[1], kInfinity);

  writeExr(folder / "float.exr", image, {}, {.floatColor = true});
  const ExrFile full = readExr(folder / "float.exr");
  EXPECT_EQ(full.image.channel("R")[0], third);
  EXPECT_EQ(full.image.find("R")->kind, ChannelKind::color);
  EXPECT_EQ(full.image.find("Z")->kind, ChannelKind::data);
}

TEST(Exr, colorAboveHalfMakesAllColorFloatWithAWarning) {
  const TemporaryFolder folder;
  Image image(3, 2);
  image.addLayer("", ChannelKind::color);
  image.addLayer("single", ChannelKind::color);
  const float third = 1.0f / 3.0f;
  image.channel("single.G")[4] = 65504.0f;  // the largest half
  image.channel("R")[0] = third;
  const fs::path path = folder / "a.exr";
  ::testing::internal::CaptureStderr();
  writeExr(path, image);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_NE(readExr(path).image.channel("R")[0], third);

  image.channel("single.G")[4] = -65505.0f;
  ::testing::internal::CaptureStderr();
  writeExr(path, image);
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("single.G"), std::string::npos) << said;
  EXPECT_NE(said.find("(1, 1)"), std::string::npos) << said;
  const Image read = readExr(path).image;
  EXPECT_EQ(read.channel("R")[0], third);
  EXPECT_EQ(read.channel("single.G")[4], -65505.0f);
}

TEST(Exr, nanAndInfiniteColorAreRefusedAndTheOldFileStays) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.exr";
  const Image good = makeImage();
  writeExr(path, good);
  const auto refusal = [&](const std::string& channel, float value) {
    Image bad = good;
    bad.channel(channel)[37 * 2 + 5] = value;
    try {
      writeExr(path, bad);
      return std::string("accepted");
    } catch (const OutputError& error) {
      return std::string(error.what());
    }
  };
  EXPECT_NE(refusal("Z", kNan).find("channel 'Z', pixel (5, 2)"), std::string::npos);
  EXPECT_NE(refusal("B", kNan).find("channel 'B', pixel (5, 2)"), std::string::npos);
  EXPECT_NE(refusal("A", -kInfinity).find("channel 'A', pixel (5, 2)"), std::string::npos);
  expectSamePixels(good, readExr(path).image);
  EXPECT_EQ(filesIn(folder.path()).size(), 1u);
}

TEST(Exr, cropKeepsBothWindows) {
  const TemporaryFolder folder;
  Image crop({-3, 5, 11, 270}, {0, 0, 640, 480});
  crop.addLayer("", ChannelKind::color);
  crop.setRgb("", 7, 200, {1.0f, 2.0f, 3.0f});
  writeExr(folder / "a.exr", crop);
  const Image read = readExr(folder / "a.exr").image;
  expectSamePixels(crop, read);
  EXPECT_EQ(read.rgb("", 7, 200), Rgb(1.0f, 2.0f, 3.0f));
  EXPECT_EQ(read.rgb("", 8, 200), Rgb(0.0f));
  EXPECT_EQ(read.rgb("", 600, 400), Rgb(0.0f));
}

TEST(Exr, roundTripOfEveryAttributeType) {
  const TemporaryFolder folder;
  Mat4d matrix;
  for (int i = 0; i < 16; ++i)
    matrix[i / 4][i % 4] = i + 0.5;
  const ExrAttributes attributes{
      {"aString", std::string("smoke, 12 µm")},
      {"emptyString", std::string()},
      {"anInt", std::int32_t{-7}},
      {"aFloat", 0.1f},
      {"aDouble", 0.1},
      {"aV2f", Vec2f(1.5f, -2.5f)},
      {"aV3f", Vec3f(1, 2, 3)},
      {"aMatrix", matrix},
      {"aRational", Rational{24000, 1001}},
      {"someChromaticities",
       Chromaticities{{0.64f, 0.33f}, {0.3f, 0.6f}, {0.15f, 0.06f}, {0.3127f, 0.329f}}},
      {"aTimeCode", TimeCode{23, 59, 58, 29, false, true}},
      {"photosphere:estimator", std::string("photosphere")},
  };
  writeExr(folder / "a.exr", makeImage(), attributes);
  const ExrAttributes read = readExr(folder / "a.exr").attributes;
  for (const auto& [name, value] : attributes) {
    ASSERT_TRUE(read.count(name)) << name;
    EXPECT_TRUE(read.at(name) == value) << name;
  }
}

TEST(Exr, reservedAttributeOfAnotherTypeIsAnOutputError) {
  const TemporaryFolder folder;
  EXPECT_THROW(writeExr(folder / "a.exr", makeImage(), {{"channels", std::string("R")}}),
               OutputError);
  EXPECT_TRUE(filesIn(folder.path()).empty());
}

TEST(Exr, matricesInTheFileTakeRowVectors) {
  const TemporaryFolder folder;
  // x' = 2 z + 10: row 0 of the column-vector matrix.
  Mat4d worldToNDC(0.0);
  worldToNDC[2][0] = 2.0;
  worldToNDC[3][0] = 10.0;
  worldToNDC[3][3] = 1.0;
  FrameMetadata metadata;
  metadata.worldToNDC = worldToNDC;
  writeExr(folder / "a.exr", makeImage(), frameAttributes(metadata), {ExrCompression::none});
  // The value in the file: name, type "m44f", size 64, then 16 floats, row by row.
  const std::string bytes = test::readText(folder / "a.exr");
  const std::string mark = std::string("worldToNDC") + '\0' + "m44f" + '\0';
  const std::size_t at = bytes.find(mark);
  ASSERT_NE(at, std::string::npos);
  float m[4][4];
  std::memcpy(m, bytes.data() + at + mark.size() + 4, sizeof(m));
  const float p[4] = {3, 4, 5, 1};
  float x = 0;
  for (int row = 0; row < 4; ++row)
    x += p[row] * m[row][0];
  EXPECT_EQ(x, 20.0f);
}

TEST(Exr, fullDeviceIsAnOutputError) {
  for (const int size : {4, 600}) {
    try {
      writeExr("/dev/full", makeImage(size, size));
      FAIL() << "size " << size << ": no error";
    } catch (const OutputError& error) {
      EXPECT_NE(std::string(error.what()).find("/dev/full"), std::string::npos) << error.what();
    }
  }
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

/// Lets files of this process grow to `bytes`, while it lives.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : m_handler(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &m_old);
    const rlimit now{bytes, m_old.rlim_max};
    setrlimit(RLIMIT_FSIZE, &now);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &m_old);
    std::signal(SIGXFSZ, m_handler);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit m_old{};
  void (*m_handler)(int);
};

TEST(Exr, fileSizeLimitLeavesTheOldFileAndNothingElse) {
  const TemporaryFolder folder;
  const fs::path path = folder / "a.exr";
  const Image small = makeImage(8, 8);
  writeExr(path, small);
  const auto wholeSize = static_cast<rlim_t>(fs::file_size(path));
  // In the header, in the pixels, and one byte short of the end.
  for (const rlim_t limit : {rlim_t{100}, wholeSize / 2, wholeSize - 1}) {
    const FileSizeLimit fileSize(limit);
    EXPECT_THROW(writeExr(path, small), OutputError) << limit;
  }
  expectSamePixels(small, readExr(path).image);
  EXPECT_EQ(filesIn(folder.path()), std::vector<std::string>{"a.exr"});
}

TEST(Exr, everyTruncationIsRefused) {
  const TemporaryFolder folder;
  writeExr(folder / "whole.exr", makeImage(9, 40));
  const std::string whole = test::readText(folder / "whole.exr");
  const fs::path path = folder / "cut.exr";
  for (std::size_t size = 0; size < whole.size(); size += 1 + size / 50) {
    test::writeText(path, whole.substr(0, size));
    EXPECT_FALSE(exrIsComplete(path)) << size;
    EXPECT_THROW(readExr(path), InputError) << size;
  }
  test::writeText(path, whole.substr(0, whole.size() - 1));
  EXPECT_FALSE(exrIsComplete(path));
  test::writeText(path, whole);
  EXPECT_TRUE(exrIsComplete(path));
}

TEST(Exr, stoppedWriterLeavesZerosInTheChunkTable) {
  const TemporaryFolder folder;
  writeExr(folder / "a.exr", makeImage(9, 40));
  std::string bytes = test::readText(folder / "a.exr");
  // The table follows the header's last zero; its first entry points just past the table.
  std::size_t table = 8;
  for (; table + 8 < bytes.size(); ++table) {
    std::uint64_t entry = 0;
    std::memcpy(&entry, bytes.data() + table, 8);
    if (entry == table + 3 * 8) break;  // 40 rows in chunks of 16
  }
  ASSERT_LT(table + 8, bytes.size());
  std::memset(bytes.data() + table + 16, 0, 8);
  test::writeText(folder / "b.exr", bytes);
  EXPECT_FALSE(exrIsComplete(folder / "b.exr"));
  EXPECT_THROW(readExr(folder / "b.exr"), InputError);
}

TEST(Exr, hugeClaimsAreRefusedBeforeMemoryIsTaken) {
  const TemporaryFolder folder;
  writeExr(folder / "whole.exr", makeImage(9, 40), {}, {ExrCompression::dwab});
  std::string bytes = test::readText(folder / "whole.exr");
  for (const char* name : {"dataWindow", "displayWindow"}) {
    const std::string mark = std::string(name) + '\0' + "box2i" + '\0';
    const std::size_t at = bytes.find(mark) + mark.size() + 4;
    const std::int32_t right = 50'000'000;
    std::memcpy(bytes.data() + at + 8, &right, 4);
  }
  test::writeText(folder / "bad.exr", bytes);
  EXPECT_THROW(readExr(folder / "bad.exr"), InputError);
}

// OpenEXR reads on to where such an attribute ends by itself, into memory that nobody stated.
TEST(Exr, attributesThatEndElsewhereThanTheySayAreRefused) {
  const TemporaryFolder folder;
  writeExr(folder / "whole.exr", makeImage(9, 40));
  const std::string whole = test::readText(folder / "whole.exr");
  const std::string channel = std::string("R") + '\0' + std::string(16, '\0') + '\0';
  const std::string text = std::string("\2\0\0\0", 4) + "ab";
  for (const auto& [type, content] :
       {std::pair<std::string, std::string>{"chlist", channel}, {"stringvector", text + text}})
    for (const int more : {-1, 0, 1}) {
      std::string size(4, '\0');
      size[0] = static_cast<char>(static_cast<int>(content.size()) + more);
      const std::string attribute = std::string("x") + '\0' + type + '\0' + size + content;
      test::writeText(folder / "x.exr", whole.substr(0, 8) + attribute +
                                            std::string(more > 0, 'z') + whole.substr(8));
      std::string message;
      try {
        readExr(folder / "x.exr");
      } catch (const InputError& error) {
        message = error.what();  // for the right size, that chunks are not where they were
      }
      EXPECT_EQ(message.find("attribute 'x' of type " + type) != std::string::npos, more != 0)
          << type << ' ' << more << ' ' << message;
    }
}

TEST(Exr, missingFileAndOtherFormats) {
  const TemporaryFolder folder;
  EXPECT_THROW(readExr(folder / "none.exr"), InputMissingError);
  EXPECT_THROW(readExr(folder.path()), InputMissingError);
  EXPECT_FALSE(exrIsComplete(folder / "none.exr"));
  test::writeText(folder / "text.exr", "this is no picture at all");
  EXPECT_THROW(readExr(folder / "text.exr"), InputError);
}

}  // namespace
}  // namespace photosphere::image
