// References: pairs combine without bias, and what is on disk is what goes on.

#include "reference.h"

#include "photosphere/core/error.h"
#include "photosphere/core/rng.h"
#include "photosphere/image/exr.h"
#include "photosphere/image/metrics.h"
#include "support/support.h"

namespace photosphere::study {
namespace {

using test::TemporaryFolder;

// A chunk of `samples` paths whose values are uniform in [0, 2].
image::Image chunk(std::uint64_t seed, int samples, int edge = 8) {
  Rng rng(RandomKey::fromSeed(seed, 0), RandomStream::test, 0);
  image::Image image(edge, edge);
  for (const char* layer : {"", "multiple", "transmittance"}) {
    image.addLayer(layer, image::ChannelKind::data);
    for (const char* letter : {"R", "G", "B"})
      for (float& v : image.channel(image::Image::channelName(layer, letter))) {
        for (int s = 0; s < samples; ++s)
          v += 2 * rng.uniform() / static_cast<float>(samples);
      }
  }
  return image;
}

// Half of the pixels of `blind` have not met what every pixel should have: they are dark and sure
// of it.
TEST(Reference, DarkPixelsThatAreSureOfItAreNotQuiet) {
  ReferenceImage seeing, blind;
  addPair(seeing, chunk(1, 4), chunk(2, 4), 4);
  image::Image half = chunk(3, 4000);
  for (const char* layer : {"", "multiple"})
    for (const char* letter : {"R", "G", "B"})
      for (float& v : half.channel(image::Image::channelName(layer, letter)))
        v *= (&v - half.channel(image::Image::channelName(layer, letter)).data()) % 2 ? 0.0f : 1.0f;
  addPair(blind, half, half, 4);
  const std::array<double, 2> noise = roughNoise(seeing, blind);
  EXPECT_GT(noise[1], 3 * noise[0]);
  // In turn; and by their own variances where they agree.
  EXPECT_NEAR(roughNoise(blind, seeing)[0], noise[1], 1e-9);
  ReferenceImage quiet;
  addPair(quiet, chunk(5, 4000), chunk(6, 4000), 4000);
  EXPECT_LT(10 * roughNoise(seeing, quiet)[1], roughNoise(seeing, quiet)[0]);
}

TEST(Reference, aPairGivesItsMeanAndTheVarianceOfThatMean) {
  const image::Image a = chunk(1, 4), b = chunk(2, 4);
  ReferenceImage reference;
  addPair(reference, a, b, 4);
  EXPECT_EQ(reference.samples, 8u);
  EXPECT_EQ(reference.pairs, 1u);
  const auto variance = image::varianceOfMean(a.channel("G"), b.channel("G"));
  for (std::size_t i = 0; i < variance.size(); ++i) {
    EXPECT_FLOAT_EQ(reference.mean(kTotal)[1][i], 0.5f * (a.channel("G")[i] + b.channel("G")[i]));
    EXPECT_FLOAT_EQ(reference.variance(kTotal)[1][i], variance[i]);
  }
}

// The variance that pairs of unequal weight leave is the error that they have.
TEST(Reference, varianceIsTheErrorOfTheMean) {
  double error = 0, variance = 0;
  constexpr int kTrials = 30;
  for (std::uint64_t t = 0; t < kTrials; ++t) {
    ReferenceImage reference;
    for (std::uint64_t k = 0; k < 5; ++k) {
      const int samples = k == 0 ? 8 : 2;
      addPair(reference, chunk(100 * t + 2 * k, samples), chunk(100 * t + 2 * k + 1, samples),
              static_cast<std::uint64_t>(samples));
    }
    ASSERT_EQ(reference.samples, 32u);
    const Planes mean = reference.mean(kMultiple), spread = reference.variance(kMultiple);
    for (const float v : mean[0])
      error += (v - 1.0) * (v - 1.0) / (64 * kTrials);
    for (const float v : spread[0])
      variance += v / (64.0 * kTrials);
  }
  const double exact = 4.0 / 12 / 32;
  EXPECT_NEAR(error, exact, 0.1 * exact);
  EXPECT_NEAR(variance, exact, 0.15 * exact);
}

TEST(Reference, noiseFallsWithTheSamples) {
  ReferenceImage reference;
  EXPECT_TRUE(std::isinf(reference.noise()[0]));
  addPair(reference, chunk(1, 4, 32), chunk(2, 4, 32), 4);
  const double before = reference.noise()[kTotal];
  for (std::uint64_t k = 1; k < 4; ++k)
    addPair(reference, chunk(2 * k + 1, 4, 32), chunk(2 * k + 2, 4, 32), 4);
  EXPECT_NEAR(reference.noise()[kTotal], before / 4, 0.1 * before);
}

TEST(Reference, comesBackFromDiskAsItWas) {
  const TemporaryFolder folder;
  ReferenceImage reference;
  addPair(reference, chunk(1, 4), chunk(2, 4), 4);
  addPair(reference, chunk(3, 4), chunk(4, 4), 4);
  // Twice, as a study that goes on does.
  writeReference(folder / "first.exr", reference, "cafe");
  writeReference(folder / "r.exr", *readReference(folder / "first.exr", "cafe"), "cafe");
  const auto read = readReference(folder / "r.exr", "cafe");
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->samples, 16u);
  EXPECT_EQ(read->pairs, 2u);
  for (const image::Channel& channel : reference.pixels.channels()) {
    const auto pixels = read->pixels.channel(channel.name);
    EXPECT_TRUE(std::equal(pixels.begin(), pixels.end(), channel.pixels.begin())) << channel.name;
  }
  EXPECT_FALSE(readReference(folder / "none.exr", "cafe").has_value());
}

TEST(Reference, anotherScenesOrADamagedFileIsRefused) {
  const TemporaryFolder folder;
  ReferenceImage reference;
  addPair(reference, chunk(1, 4), chunk(2, 4), 4);
  writeReference(folder / "r.exr", reference, "cafe");
  EXPECT_THROW(readReference(folder / "r.exr", "beef"), InputError);
  image::Image poor(2, 2);
  poor.addLayer("", image::ChannelKind::data);
  image::writeExr(folder / "poor.exr", poor,
                  {{"photosphere:reference_key", std::string("cafe")},
                   {"photosphere:samples", std::string("4")},
                   {"photosphere:pairs", std::string("1")}});
  EXPECT_THROW(readReference(folder / "poor.exr", "cafe"), InputError);
  image::writeExr(folder / "number.exr", reference.pixels,
                  {{"photosphere:reference_key", std::string("cafe")},
                   {"photosphere:samples", std::string("-4")},
                   {"photosphere:pairs", std::string("1")}});
  EXPECT_THROW(readReference(folder / "number.exr", "cafe"), InputError);
  std::filesystem::resize_file(folder / "r.exr", std::filesystem::file_size(folder / "r.exr") / 2);
  EXPECT_THROW(readReference(folder / "r.exr", "cafe"), InputError);
}

TEST(Reference, chunksOfAnotherSizeAreRefused) {
  ReferenceImage reference;
  addPair(reference, chunk(1, 4), chunk(2, 4), 4);
  EXPECT_THROW(addPair(reference, chunk(1, 4, 9), chunk(2, 4, 9), 4), ConfigError);
}

TEST(FileStem, keepsHarmlessCharactersAlone) {
  EXPECT_EQ(fileStem("column-2"), "column-2");
  EXPECT_EQ(fileStem("../a b<c>"), "___a_b_c_");
  EXPECT_EQ(fileStem(""), "scene");
}

}  // namespace
}  // namespace photosphere::study
