// Error metrics against numbers worked out by hand.

#include "photosphere/image/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "photosphere/core/error.h"
#include "photosphere/core/rng.h"

namespace photosphere::image {
namespace {

constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();

ErrorMetrics measureGrey(const std::vector<float>& image, const std::vector<float>& reference,
                         const MeasureOptions& options = {}) {
  return measure({image}, {reference}, 2, {10, 20}, options);
}

TEST(Metrics, byHand) {
  const ErrorMetrics m = measureGrey({1.5f, 2.0f, 2.0f, 0.25f}, {1.0f, 2.0f, 3.0f, 0.0f});
  // mean ref = 1.5, so 0.0225 joins each ref^2; d^2 = 0.25, 0, 1, 0.0625.
  EXPECT_NEAR(m.relMse, (0.25 / 1.0225 + 1.0 / 9.0225 + 0.0625 / 0.0225) / 4, 1e-12);
  EXPECT_NEAR(m.relMse, 0.783278, 1e-6);
  EXPECT_NEAR(m.relativeError, std::sqrt(m.relMse), 1e-12);
  EXPECT_NEAR(m.rmse, std::sqrt(1.3125 / 4), 1e-12);
  EXPECT_NEAR(m.relativeL2, std::sqrt(1.3125 / 14), 1e-12);
  EXPECT_NEAR(m.meanRatio, 5.75 / 6.0, 1e-12);
  EXPECT_EQ(m.maxDifference, 1.0);
  EXPECT_EQ(m.worstPixel, Vec2i(10, 21));
  EXPECT_EQ(m.pixels, 4u);
}

TEST(Metrics, meanIsOverAllChannels) {
  const std::vector<float> one{1.0f}, two{2.0f}, three{3.0f};
  const ErrorMetrics m = measure({two, two, three}, {one, two, three}, 1);
  EXPECT_NEAR(m.relMse, 1.0 / 1.04 / 3, 1e-12);
}

TEST(Metrics, maskChoosesPixelsAndTheirMean) {
  const std::vector<unsigned char> mask{0, 1, 0, 1};
  MeasureOptions options;
  options.mask = mask;
  const ErrorMetrics m = measureGrey({9.0f, 2.5f, 9.0f, 4.0f}, {1.0f, 2.0f, 1.0f, 4.0f}, options);
  EXPECT_EQ(m.pixels, 2u);
  EXPECT_NEAR(m.relMse, 0.25 / (4.0 + 0.09) / 2, 1e-12);
  EXPECT_EQ(m.worstPixel, Vec2i(11, 20));
}

TEST(Metrics, equalImagesAndBlackImages) {
  EXPECT_EQ(measureGrey({1, 2, 3, 4}, {1, 2, 3, 4}).relMse, 0.0);
  const ErrorMetrics black = measureGrey({0, 0, 0, 0}, {0, 0, 0, 0});
  EXPECT_EQ(black.relMse, 0.0);
  EXPECT_EQ(black.meanRatio, 1.0);
  EXPECT_EQ(black.relativeL2, 0.0);
  EXPECT_TRUE(std::isinf(measureGrey({1, 0, 0, 0}, {0, 0, 0, 0}).relMse));
}

TEST(Metrics, nonFinitePixelsAreCountedAndLeftOut) {
  const ErrorMetrics m =
      measureGrey({kNotANumber, 2.0f, kInfinity, 5.0f}, {1.0f, kNotANumber, kInfinity, 4.0f});
  EXPECT_EQ(m.nonFiniteImage, 1u);
  EXPECT_EQ(m.nonFiniteReference, 1u);
  EXPECT_EQ(m.pixels, 1u);
  EXPECT_EQ(m.rmse, 1.0);
  const ErrorMetrics one = measureGrey({kInfinity, 1, 1, 1}, {1, 1, 1, 1});
  EXPECT_EQ(one.nonFiniteImage, 1u);
  EXPECT_EQ(one.nonFiniteReference, 0u);
}

TEST(Metrics, referenceVarianceIsSubtracted) {
  const std::vector<float> image{1.5f, 2.0f}, reference{1.0f, 2.0f}, variance{0.01f, 0.02f};
  MeasureOptions options;
  options.referenceVariance.emplace_back(variance);
  const ErrorMetrics m = measure({image}, {reference}, 2, {0, 0}, options);
  const double noise = (0.01 / 1.0225 + 0.02 / 4.0225) / 2;
  EXPECT_NEAR(m.referenceNoise, noise, 1e-9);
  EXPECT_NEAR(m.unbiasedRelMse, 0.25 / 1.0225 / 2 - noise, 1e-9);
}

TEST(Metrics, differentSizesAreRefused) {
  const std::vector<float> two(2), three(3);
  EXPECT_THROW(measure({two}, {three}, 1), ConfigError);
  EXPECT_THROW(measure({two}, {two, two}, 1), ConfigError);
  EXPECT_THROW(measure({}, {}, 1), ConfigError);
}

Image makeGrey(const Window& data, float value) {
  Image image(data, {0, 0, 100, 100});
  image.addLayer("", ChannelKind::color, "RGBA");
  for (const Channel& channel : image.channels())
    for (float& pixel : image.channel(channel.name))
      pixel = value;
  return image;
}

TEST(CompareImages, twoHalvesOfANoisyReferenceRemoveItsNoise) {
  const Window window{0, 0, 100, 100};
  Image halves[2] = {makeGrey(window, 1), makeGrey(window, 1)};
  Rng rng(RandomKey::fromSeed(11, 0), RandomStream::test, 0);
  for (Image& half : halves)
    for (const char* name : {"R", "G", "B"})
      // Uniform of variance 0.01: the mean of two halves has 0.005.
      for (float& pixel : half.channel(name))
        pixel += (rng.uniform() - 0.5f) * std::sqrt(0.12f);
  CompareOptions options;
  options.secondReference = &halves[1];
  const ImageComparison result = compareImages(makeGrey(window, 1), halves[0], options);
  ASSERT_EQ(result.layers[0].layer, "RGB");
  const ErrorMetrics& m = result.layers[0].all;
  // 30,000 values: standard error of relMse about 0.005 / 150.
  EXPECT_NEAR(m.relMse, 0.005, 4e-4);
  EXPECT_NEAR(m.referenceNoise, 0.005, 4e-4);
  EXPECT_NEAR(m.unbiasedRelMse, 0.0, 3e-4);
}

TEST(CompareImages, smokeOnlyFollowsTransmittanceOrAlpha) {
  const Window window{0, 0, 2, 1};
  Image reference = makeGrey(window, 1.0f);
  reference.channel("A")[1] = 0.005f;  // transmittance 0.995: empty
  Image image = makeGrey(window, 1.0f);
  image.setRgb("", 1, 0, Rgb(2.0f));
  ImageComparison result = compareImages(image, reference);
  ASSERT_TRUE(result.layers[0].smokeOnly.has_value());
  EXPECT_EQ(result.layers[0].smokeOnly->pixels, 1u);
  EXPECT_EQ(result.layers[0].smokeOnly->relMse, 0.0);
  EXPECT_GT(result.layers[0].all.relMse, 0.0);

  // The layer wins over alpha: now the other pixel is empty.
  reference.addLayer("transmittance", ChannelKind::color);
  reference.setRgb("transmittance", 0, 0, Rgb(1.0f));
  result = compareImages(image, reference);
  EXPECT_EQ(result.layers[0].smokeOnly->pixels, 1u);
  EXPECT_GT(result.layers[0].smokeOnly->relMse, 0.0);
  EXPECT_EQ(result.onlyInReference.size(), 3u);
}

TEST(CompareImages, cropsAreComparedWhereTheyOverlapWhenAllowed) {
  const Image whole = makeGrey({0, 0, 100, 100}, 1.0f);
  Image crop = makeGrey({90, 95, 20, 10}, 1.0f);
  crop.setRgb("", 92, 99, Rgb(3.0f));
  EXPECT_THROW(compareImages(crop, whole), ConfigError);
  CompareOptions options;
  options.allowCrop = true;
  const ImageComparison result = compareImages(crop, whole, options);
  EXPECT_EQ(result.window, (Window{90, 95, 10, 5}));
  EXPECT_EQ(result.layers[0].all.pixels, 50u);
  EXPECT_EQ(result.layers[0].all.worstPixel, Vec2i(92, 99));
  EXPECT_NEAR(result.layers[0].all.relMse, 4.0 / 1.01 / 50, 1e-9);
  EXPECT_THROW(compareImages(makeGrey({200, 0, 4, 4}, 1), whole, options), ConfigError);
}

// Far and finite where a ray met nothing: such pixels would drown the others.
TEST(CompareImages, depthIsComparedWhereEitherMetSomething) {
  Image a(4, 1), b(4, 1);
  const auto za = a.addChannel("Z"), zb = b.addChannel("Z");
  const float depthsA[] = {2.0f, 1e10f, 1e10f, 5.0f}, depthsB[] = {2.5f, 1e10f, 1e10f, 5.0f};
  std::copy(depthsA, depthsA + 4, za.begin());
  std::copy(depthsB, depthsB + 4, zb.begin());
  const ErrorMetrics z = compareImages(a, b).layers[0].all;
  EXPECT_EQ(z.pixels, 2u);
  EXPECT_NEAR(z.meanReference, 3.75, 1e-6);
  EXPECT_NEAR(z.rmse, 0.5 / std::sqrt(2.0), 1e-6);
}

TEST(CompareImages, nothingInCommonIsAnError) {
  Image a(2, 2), b(2, 2);
  a.addChannel("Z");
  b.addChannel("W");
  EXPECT_THROW(compareImages(a, b), ConfigError);
}

}  // namespace
}  // namespace photosphere::image
