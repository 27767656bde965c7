// Colour: which config is used, its conversions, and what previews show.

#include "photosphere/image/color.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "photosphere/core/error.h"
#include "photosphere/image/exr.h"
#include "photosphere/image/load.h"
#include "photosphere/image/preview.h"
#include "support/support.h"

namespace photosphere::image {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

/// Sets an environment variable while it lives.
class Environment {
 public:
  Environment(const char* name, const std::string& value) : m_name(name) {
    if (const char* old = std::getenv(name)) m_old = old;
    setenv(name, value.c_str(), 1);
  }
  ~Environment() { m_old.empty() ? unsetenv(m_name) : setenv(m_name, m_old.c_str(), 1); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* m_name;
  std::string m_old;
};

ColorConfig shipped() {
  const Environment none("OCIO", "");
  return ColorConfig::load();
}

void expectColor(const Rgb& color, const Rgb& expected, float tolerance) {
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(color[c], expected[c], tolerance) << "channel " << c;
}

template <class E, class F>
std::string message(const F& call) {
  try {
    call();
  } catch (const E& error) {
    return error.what();
  }
  ADD_FAILURE() << "no error of the expected kind";
  return {};
}

TEST(ColorConfig, fallsBackToTheShippedConfig) {
  EXPECT_EQ(shipped().source(), test::projectFile("data/color/config.ocio").string());
}

TEST(ColorConfig, optionWinsOverEnvironmentWinsOverShipped) {
  const TemporaryFolder folder;
  const std::string text = test::readText(test::projectFile("data/color/config.ocio"));
  test::writeText(folder / "a.ocio", text);
  test::writeText(folder / "b.ocio", text);
  const Environment ocio("OCIO", (folder / "a.ocio").string());
  EXPECT_EQ(ColorConfig::load().source(), (folder / "a.ocio").string());
  EXPECT_EQ(ColorConfig::load((folder / "b.ocio").string()).source(), (folder / "b.ocio").string());
}

TEST(ColorConfig, dataFolderOfTheEnvironmentComesFirst) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "color");
  test::writeText(folder / "color/config.ocio", "x");
  const Environment data("PHOTOSPHERE_DATA", folder.path().string());
  EXPECT_EQ(shippedColorConfig(), (folder / "color/config.ocio").string());
}

TEST(ColorConfig, missingBrokenAndBuiltInConfigsAreNamed) {
  const TemporaryFolder folder;
  const std::string missing = (folder / "none.ocio").string();
  const Environment ocio("OCIO", missing);
  const std::string first = message<InputMissingError>([] { ColorConfig::load(); });
  EXPECT_NE(first.find(missing), std::string::npos) << first;
  EXPECT_NE(first.find("$OCIO"), std::string::npos) << first;

  const std::string broken = (folder / "broken.ocio").string();
  for (const char* text :
       {"", "ocio_profile_version: 2\nroles: [",
        "\x7f"
        "ELF",
        "ocio_profile_version: 99\n", "ocio_profile_version: 2\nroles: {scene_linear: nowhere}\n",
        // What it says is not what has befallen its reader.
        "ocio_profile_version: 2\nroles: {'bad_alloc: failed. std::bad_alloc\n",
        "ocio_profile_version: std::bad_alloc\n"}) {
    test::writeText(broken, text);
    const std::string said = message<InputError>([&] { ColorConfig::load(broken); });
    EXPECT_NE(said.find(broken), std::string::npos) << said;
  }
  const std::string builtIn = message<ConfigError>([] { ColorConfig::load("ocio://default"); });
  EXPECT_NE(builtIn.find("2.2"), std::string::npos) << builtIn;
}

TEST(ColorConfig, unknownNamesListTheKnown) {
  const ColorConfig config = shipped();
  const std::string space = message<ConfigError>([&] { config.converter("ACEScgg", "sRGB"); });
  EXPECT_NE(space.find("ACEScgg"), std::string::npos) << space;
  EXPECT_NE(space.find("Linear Rec.2020"), std::string::npos) << space;
  const std::string display =
      message<ConfigError>([&] { config.displayConverter("ACEScg", "CRT", ""); });
  EXPECT_NE(display.find("sRGB"), std::string::npos) << display;
  const std::string view =
      message<ConfigError>([&] { config.displayConverter("ACEScg", "", "Filmic"); });
  EXPECT_NE(view.find("Un-tone-mapped"), std::string::npos) << view;
  EXPECT_THROW(config.chromaticities("nowhere"), ConfigError);
}

TEST(ColorConfig, conversionsAgreeWithPublishedMatrices) {
  const ColorConfig config = shipped();
  // AP1 to Rec.709 with Bradford adaptation, first column.
  expectColor(config.converter("ACEScg", "lin_rec709")({1, 0, 0}), {1.70505f, -0.13026f, -0.02400f},
              1e-4f);
  // ITU-R BT.2087-0, inverse of its Rec.709 to Rec.2020 matrix, first column.
  expectColor(config.converter("lin_rec2020", "lin_rec709")({1, 0, 0}),
              {1.66049f, -0.12455f, -0.01815f}, 1e-4f);
  // SMPTE ST 2065-1: AP1 to AP0, second column.
  expectColor(config.converter("ACEScg", "ACES2065-1")({0, 1, 0}), {0.14068f, 0.85967f, 0.00403f},
              1e-4f);
  // Every white stays white.
  for (const char* space : {"ACES2065-1", "lin_rec709", "lin_rec2020", "lin_p3d65", "sRGB"})
    expectColor(config.converter("scene_linear", space)(Rgb(1.0f)), Rgb(1.0f), 2e-4f);
  // IEC 61966-2-1: half the code value is 0.2140 of the light.
  expectColor(config.converter("sRGB", "lin_srgb")(Rgb(0.5f)), Rgb(0.21404f), 1e-4f);
  expectColor(config.converter("raw", "ACEScg")({-1, 0.5f, 7}), {-1, 0.5f, 7}, 0.0f);
}

TEST(ColorConfig, manyPixelsConvertLikeOne) {
  const ColorConverter convert = shipped().converter("ACEScg", "lin_rec709");
  std::vector<float> pixels;
  for (int i = 0; i < 30; ++i)
    pixels.push_back(0.1f * static_cast<float>(i));
  const std::vector<float> before = pixels;
  convert.apply(pixels);
  for (std::size_t i = 0; i < pixels.size(); i += 3)
    expectColor({pixels[i], pixels[i + 1], pixels[i + 2]},
                convert({before[i], before[i + 1], before[i + 2]}), 1e-6f);
}

TEST(ColorConfig, chromaticitiesByNameAliasAndRole) {
  const ColorConfig config = shipped();
  EXPECT_EQ(config.chromaticities("ACEScg")->red, Vec2f(0.713f, 0.293f));
  EXPECT_EQ(config.chromaticities("scene_linear")->white, Vec2f(0.32168f, 0.33767f));
  EXPECT_EQ(config.chromaticities("ACES2065-1")->blue, Vec2f(0.0001f, -0.077f));
  EXPECT_EQ(config.chromaticities("lin_srgb")->green, Vec2f(0.3f, 0.6f));
  EXPECT_EQ(config.chromaticities("Linear Rec.2020")->green, Vec2f(0.17f, 0.797f));
  EXPECT_FALSE(config.chromaticities("sRGB").has_value());  // not linear
  EXPECT_FALSE(config.chromaticities("raw").has_value());
}

/// Levels 0-255 of pixel (x, y) of an 8-bit picture.
Rgb levels(const fs::path& path, int x, int y) {
  return loadImage(path).image.rgb("", x, y) * 255.0f;
}

Image greyImage(float value) {
  Image image({1, 0, 1, 2}, {0, 0, 3, 2});
  image.addLayer("", ChannelKind::color);
  image.addLayer("single", ChannelKind::color);
  for (int y = 0; y < 2; ++y)
    image.setRgb("", 1, y, Rgb(value));
  for (int y = 0; y < 2; ++y)
    image.setRgb("single", 1, y, Rgb(1.0f));
  return image;
}

TEST(Preview, middleGreyAndWhiteHaveTheirLevels) {
  const TemporaryFolder folder;
  const ColorConfig config = shipped();
  const auto shown = [&](float value, const DisplayOptions& options) {
    writePreview(folder / "a.png", greyImage(value), config, options);
    EXPECT_NEAR(levels(folder / "a.png", 0, 0).x, 0.0f, 1e-3f);  // outside the data window
    return levels(folder / "a.png", 1, 1);
  };
  // sRGB of 0.18 is 0.46136: level 117.6.
  expectColor(shown(0.18f, {.view = "Un-tone-mapped"}), Rgb(118.0f), 1e-3f);
  expectColor(shown(0.36f, {.view = "Un-tone-mapped", .exposure = -1.0f}), Rgb(118.0f), 1e-3f);
  expectColor(shown(50.0f, {.view = "Un-tone-mapped"}), Rgb(255.0f), 1e-3f);
  expectColor(shown(0.25f, {.view = "Raw"}), Rgb(64.0f), 1e-3f);
  // The ACES output transform puts middle grey at 4.8 of 48 nits above a black of 0.02, then raises
  // it to 0.9811 for the dim surround: ((4.8 - 0.02) / 47.98)^0.9811 = 0.104, in sRGB level 90.8.
  expectColor(shown(0.18f, {}), Rgb(91.0f), 1e-3f);
  expectColor(shown(0.0f, {.layer = "single", .view = "Un-tone-mapped"}), Rgb(255.0f), 1e-3f);
}

TEST(Preview, jpegIsAPicture) {
  const TemporaryFolder folder;
  Image image(32, 16);
  image.addLayer("", ChannelKind::color);
  for (const char* name : {"R", "G", "B"})
    for (float& pixel : image.channel(name))
      pixel = 0.18f;
  writePreview(folder / "a.jpg", image, shipped(), {.view = "Un-tone-mapped"});
  EXPECT_EQ(test::readText(folder / "a.jpg").substr(0, 2), "\xff\xd8");
  expectColor(levels(folder / "a.jpg", 9, 9), Rgb(118.0f), 2.0f);
}

TEST(Preview, ditherKeepsTheMean) {
  const TemporaryFolder folder;
  Image image(128, 128);
  image.addLayer("", ChannelKind::color);
  for (const char* name : {"R", "G", "B"})
    for (float& pixel : image.channel(name))
      pixel = 100.3f / 255.0f;
  const auto mean = [&](bool dither) {
    writePreview(folder / "a.png", image, shipped(), {.view = "Raw", .dither = dither});
    const LoadedImage loaded = loadImage(folder / "a.png");
    double sum = 0;
    for (const float value : loaded.image.channel("G"))
      sum += value * 255.0;
    return sum / static_cast<double>(loaded.image.pixelCount());
  };
  EXPECT_NEAR(mean(false), 100.0, 1e-3);
  EXPECT_NEAR(mean(true), 100.3, 0.05);
}

TEST(Preview, wrongExtensionAndFullDevice) {
  const TemporaryFolder folder;
  EXPECT_THROW(writePreview(folder / "a.exr", greyImage(1), shipped()), ConfigError);
  EXPECT_THROW(writePreview(folder / "a.png", greyImage(1), shipped(), {.layer = "none"}),
               ConfigError);
  EXPECT_TRUE(fs::is_empty(folder.path()));
  fs::create_symlink("/dev/full", folder / "full.png");
  EXPECT_THROW(writePreview(folder / "full.png", greyImage(1), shipped()), OutputError);
}

TEST(LoadImage, exrKeepsItsValuesAndGreySpreads) {
  const TemporaryFolder folder;
  Image image(3, 2);
  image.addLayer("", ChannelKind::color);
  image.setRgb("", 2, 1, {1000.5f, 0.25f, 0});
  writeExr(folder / "a.exr", image, {}, {.floatColor = true});
  EXPECT_EQ(loadImage(folder / "a.exr").image.rgb("", 2, 1), Rgb(1000.5f, 0.25f, 0));

  Image grey(2, 2);
  grey.addChannel("Y")[3] = 0.75f;
  writeExr(folder / "y.exr", grey);
  EXPECT_EQ(loadImage(folder / "y.exr").image.rgb("", 1, 1), Rgb(0.75f));

  Image data(2, 2);
  data.addChannel("Z");
  writeExr(folder / "z.exr", data);
  EXPECT_THROW(loadImage(folder / "z.exr"), InputError);
}

TEST(LoadImage, pngSaysItsSpaceAndDamageIsRefused) {
  const TemporaryFolder folder;
  writePreview(folder / "a.png", greyImage(0.18f), shipped());
  EXPECT_EQ(loadImage(folder / "a.png").colorSpace, "sRGB");
  const std::string whole = test::readText(folder / "a.png");
  test::writeText(folder / "cut.png", whole.substr(0, whole.size() / 2));
  EXPECT_THROW(loadImage(folder / "cut.png"), InputError);
  test::writeText(folder / "text.png", "no picture");
  EXPECT_THROW(loadImage(folder / "text.png"), InputError);
  EXPECT_THROW(loadImage(folder / "none.png"), InputMissingError);
  EXPECT_THROW(loadImage(folder.path()), InputMissingError);
}

}  // namespace
}  // namespace photosphere::image
