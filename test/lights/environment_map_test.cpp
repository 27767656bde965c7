// Surroundings from a picture: what is drawn, what is read, and where up is.
#include <cmath>
#include <limits>

#include "fixture.h"
#include "photosphere/core/error.h"
#include "photosphere/image/exr.h"

namespace photosphere::lights {
namespace {

// A dim sky, a bright patch, and a black row.
image::Image sky(int width, int height) {
  image::Image picture(width, height);
  picture.addLayer("", image::ChannelKind::color);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const bool sun = y >= height / 4 && y < height / 4 + 2 && x >= width / 8 && x < width / 8 + 3;
      const float value = y == height - 2 ? 0.0f
                          : sun           ? 80.0f
                                          : 0.2f + 0.1f * static_cast<float>(y % 3);
      const std::size_t i = picture.index(x, y);
      picture.channel("R")[i] = value;
      picture.channel("G")[i] = 0.9f * value;
      picture.channel("B")[i] = sun ? 0.5f * value : 1.2f * value;
    }
  return picture;
}

struct Sky : ::testing::Test {
  std::unique_ptr<Light> light(const image::Image& picture, const std::string& intensity = "1") {
    const std::string path = (folder / "sky.exr").string();
    image::ExrOptions options;
    options.floatColor = true;
    image::writeExr(path, picture, {}, options);
    return makeLight("environment", {{"file", path}, {"intensity", intensity}});
  }
  test::TemporaryFolder folder;
};

// What lies around a picture that was trimmed to its light is dark, and what lies outside it is cut
// off: the display window is the sphere.
TEST_F(Sky, TheDisplayWindowIsTheSphere) {
  const image::Image whole = sky(64, 32);
  const auto windowed = [&](const image::Window& data, const image::Window& display) {
    image::Image picture(data, display);
    picture.addLayer("", image::ChannelKind::color);
    for (int y = 0; y < data.height; ++y)
      for (int x = 0; x < data.width; ++x) {
        const Vec2i at(x + data.x - display.x, y + data.y - display.y);
        const bool within = at.x >= 0 && at.y >= 0 && at.x < 64 && at.y < 32;
        for (const char* channel : {"R", "G", "B"})
          picture.channel(channel)[static_cast<std::size_t>(y * data.width + x)] =
              within ? whole.channel(channel)[whole.index(at.x, at.y)] : 1e6f;
      }
    return picture;
  };
  const auto all = light(whole);
  const auto trimmed = light(windowed({8, 4, 40, 20}, {0, 0, 64, 32}));
  const auto moved = light(windowed({-90, 7, 64, 32}, {-90, 7, 64, 32}));
  const auto wider = light(windowed({-3, -2, 70, 36}, {0, 0, 64, 32}));
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x) {
      const double latitude = kPi * (y + 0.5) / 32, longitude = kPi * (1 - (x + 0.5) / 32);
      const Vec3f d(Vec3d(std::sin(latitude) * std::sin(longitude), std::cos(latitude),
                          std::sin(latitude) * std::cos(longitude)));
      const bool inside = x > 8 && x < 47 && y > 4 && y < 23;
      const bool outside = x < 7 || x > 48 || y < 3 || y > 24;
      const float there = all->background(d).x;
      if (inside) {
        EXPECT_NEAR(trimmed->background(d).x, there, 1e-3f * there) << x << ", " << y;
      }
      if (outside) {
        EXPECT_EQ(trimmed->background(d).x, 0.0f) << x << ", " << y;
      }
      EXPECT_EQ(moved->background(d).x, there) << x << ", " << y;
      EXPECT_EQ(wider->background(d).x, there) << x << ", " << y;
    }
}

// Integral of the background over the sphere, by a fine lattice.
Vec3d integralOf(const Light& light) {
  Vec3d sum(0.0);
  const int n = 600;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < 2 * n; ++j) {
      const double cosine = 1 - 2 * (i + 0.5) / n, phi = kPi * (j + 0.5) / n;
      const double sine = std::sqrt(1 - cosine * cosine);
      sum +=
          Vec3d(light.background(Vec3f(Vec3d(sine * std::cos(phi), cosine, sine * std::sin(phi)))));
    }
  return sum * (4 * kPi / (2.0 * n * n));
}

TEST_F(Sky, IlluminationPhotonsAndBackgroundAgree) {
  const auto map = light(sky(64, 32), "2");
  const Vec3d expected = integralOf(*map);
  const BoundingSphere bounds{{1, 2, 3}, 2};
  Rng rng(RandomKey::fromSeed(5, 0), RandomStream::test, 0);
  Mean fluence[3], power[3];
  for (int i = 0; i < 400'000; ++i) {
    const Illumination in = map->illuminate(Vec3f(0), rng.uniform2());
    const Emission photon = map->emit(bounds, uniform4(rng));
    ASSERT_NEAR(glm::length(Vec3d(in.direction)), 1, 3e-7);
    for (int c = 0; c < 3; ++c) {
      fluence[c].add(static_cast<double>(in.irradiance[c]));
      power[c].add(static_cast<double>(photon.power[c]));
    }
  }
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(fluence[c].mean() / expected[c], 1, 4.5 * fluence[c].error() / expected[c] + 3e-3);
    EXPECT_LT(fluence[c].error() / expected[c], 0.005) << "the sun is drawn as often as it shines";
    EXPECT_NEAR(power[c].mean() / (expected[c] * kPi * 4), 1,
                4.5 * power[c].error() / power[c].mean() + 3e-3);
    EXPECT_NEAR(static_cast<double>(map->power(bounds)[c]) / (expected[c] * kPi * 4), 1, 0.02);
  }
}

// What is drawn in a cell of directions is what shines from there.
TEST_F(Sky, DrawsEachDirectionByItsLight) {
  const auto map = light(sky(32, 16));
  Rng rng(RandomKey::fromSeed(6, 0), RandomStream::test, 0);
  const int count = 400'000;
  Vec3d drawn(0.0), upward(0.0);
  for (int i = 0; i < count; ++i) {
    const Illumination in = map->illuminate(Vec3f(0), rng.uniform2());
    const Rgb seen = map->background(-in.direction);
    // Radiance as read: drawn values differ from it by rounding of the angles alone.
    const Vec3d value = Vec3d(in.irradiance) / static_cast<double>(count);
    drawn += value;
    upward += -static_cast<double>(in.direction.y) * value;
    ASSERT_GT(maxComponent(seen), 0.0f);
    ASSERT_NEAR(in.irradiance.r / in.irradiance.g, seen.r / seen.g, 0.02f);
  }
  Vec3d expected(0.0);
  const int n = 400;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < 2 * n; ++j) {
      const double cosine = 1 - 2 * (i + 0.5) / n, phi = kPi * (j + 0.5) / n;
      const double sine = std::sqrt(1 - cosine * cosine);
      expected +=
          cosine *
          Vec3d(map->background(Vec3f(Vec3d(sine * std::cos(phi), cosine, sine * std::sin(phi))))) *
          (4 * kPi / (2.0 * n * n));
    }
  EXPECT_NEAR(upward.r / expected.r, 1, 0.02);
  EXPECT_GT(drawn.r, 0);
}

// OpenEXR's ImfEnvmap: +Z in the middle, +X to its left, +Y up.
TEST_F(Sky, LiesAsOpenExrSays) {
  image::Image picture(64, 32);
  picture.addLayer("", image::ChannelKind::color);
  const auto mark = [&](int x, int y, const char* channel) {
    for (int v = -1; v <= 1; ++v)
      for (int u = -1; u <= 1; ++u)
        picture.channel(channel)[picture.index(x + u, y + v)] = 1.0f;
  };
  mark(32, 16, "R");
  mark(16, 16, "G");
  for (int x = 1; x < 63; x += 3)
    mark(x, 1, "B");
  const auto map = light(picture);
  EXPECT_NEAR(map->background({0, 0, 1}).r, 1, 1e-5);
  EXPECT_NEAR(map->background({1, 0, 0}).g, 1, 1e-5);
  EXPECT_NEAR(map->background(Vec3f(glm::normalize(Vec3d(0.05, 1, 0.05)))).b, 1, 1e-5);
  EXPECT_EQ(map->background({0, 0, -1}), Rgb(0.0f));
  EXPECT_FALSE(map->isGrey());
  EXPECT_FALSE(map->isUniform());
}

TEST_F(Sky, IsHashedByItsPixels) {
  const auto hashOf = [](const Light& l) {
    Hasher hasher;
    l.addContent(hasher);
    return hasher.hex();
  };
  const auto a = light(sky(32, 16)), b = light(sky(32, 16)), c = light(sky(64, 32));
  EXPECT_EQ(hashOf(*a), hashOf(*b));
  EXPECT_NE(hashOf(*a), hashOf(*c));
}

TEST_F(Sky, NamesPixelsThatAreNoLight) {
  image::Image picture = sky(8, 4);
  EXPECT_FALSE(light(picture)->invalidContent());
  const Rgb upper = light(picture)->background({0, 1, 0});
  picture.channel("G")[picture.index(3, 2)] = -0.5f;
  const auto below = light(picture)->invalidContent();
  ASSERT_TRUE(below);
  EXPECT_TRUE(below->finite);
  EXPECT_EQ(below->what, "0 NaN, 0 infinite and 1 negative pixels, the first (-0.5) at (3, 2)");
  picture.channel("R")[picture.index(5, 2)] = 1234.5f;
  picture.channel("B")[picture.index(5, 2)] = -1.0f;
  picture.channel("B")[picture.index(6, 3)] = 5432.1f;
  const std::filesystem::path file = folder / "bad.exr";
  image::ExrOptions options;
  options.compression = image::ExrCompression::none;
  options.floatColor = true;
  image::writeExr(file, picture, {}, options);
  test::replaceFloats(file, 1234.5f, std::numeric_limits<float>::infinity());
  test::replaceFloats(file, 5432.1f, std::numeric_limits<float>::quiet_NaN());
  const auto map = makeLight("environment", {{"file", file.string()}});
  ASSERT_TRUE(map->invalidContent());
  EXPECT_FALSE(map->invalidContent()->finite);
  EXPECT_EQ(map->invalidContent()->what,
            "1 NaN, 1 infinite and 1 negative pixels, the first (-0.5) at (3, 2)");
  EXPECT_EQ(map->background({0, 1, 0}), upper);
  EXPECT_TRUE(std::isfinite(maxComponent(map->power({Vec3d(0), 1}))));
}

// Sums of a row past what a float holds would send photons into no direction.
TEST_F(Sky, MoreLightThanAFloatHoldsIsRefused) {
  image::Image picture(8, 4);
  picture.addLayer("", image::ChannelKind::color);
  picture.setRgb("", 3, 1, Rgb(1e36f));
  const auto map = light(picture);
  Rng rng(RandomKey::fromSeed(9, 0), RandomStream::test, 0);
  for (int i = 0; i < 1000; ++i) {
    const Emission photon = map->emit({Vec3d(0), 1}, uniform4(rng));
    ASSERT_NEAR(glm::length(Vec3d(photon.direction)), 1, 1e-6);
    ASSERT_TRUE(std::isfinite(photon.power.r));
  }
  EXPECT_THROW(light(picture, "300"), ConfigError);
  EXPECT_THROW(makeLight("point", {{"intensity", "1e39"}}), ConfigError);
  picture.setRgb("", 3, 1, Rgb(3e38f));
  EXPECT_THROW(light(picture), ConfigError);
}

TEST_F(Sky, BlackAndMissingAndDamagedPicturesAreAnswered) {
  image::Image black(8, 4);
  black.addLayer("", image::ChannelKind::color);
  const auto map = light(black);
  EXPECT_EQ(map->power({{0, 0, 0}, 1}), Rgb(0.0f));
  EXPECT_EQ(map->illuminate(Vec3f(0), {0.5f, 0.5f}).irradiance, Rgb(0.0f));
  EXPECT_EQ(map->emit({{0, 0, 0}, 1}, Vec4f(0.5f)).power, Rgb(0.0f));
  EXPECT_THROW(makeLight("environment", {{"file", (folder / "none.exr").string()}}),
               InputMissingError);
}

}  // namespace
}  // namespace photosphere::lights
