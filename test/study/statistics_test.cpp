// Bias and variance of frames whose bias and variance are known.

#include "photosphere/study/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "photosphere/core/rng.h"
#include "photosphere/image/metrics.h"

namespace photosphere::study {
namespace {

constexpr std::size_t kPixels = 400;

class Noise {
 public:
  explicit Noise(std::uint64_t seed) : m_rng(RandomKey::fromSeed(seed, 0), RandomStream::test, 0) {}
  float gaussian() {
    const double u = 1 - m_rng.uniformDouble(), v = m_rng.uniformDouble();
    return static_cast<float>(std::sqrt(-2 * std::log(u)) * std::cos(2 * kPi * v));
  }

 private:
  Rng m_rng;
};

using Frame = std::vector<std::vector<float>>;

Planes planes(const Frame& frame) {
  return {frame.begin(), frame.end()};
}

Frame frameOf(float mean, float sigma, Noise& noise) {
  Frame frame(3, std::vector<float>(kPixels));
  for (auto& plane : frame)
    for (float& v : plane)
      v = mean + sigma * noise.gaussian();
  return frame;
}

std::vector<Planes> planes(const std::vector<Frame>& frames) {
  std::vector<Planes> all;
  for (const Frame& frame : frames)
    all.push_back(planes(frame));
  return all;
}

struct Truth {
  float bias = 0.2f, sigma = 0.3f, referenceSigma = 0;
};

// Figures of `seeds` frames of truth 2, whose relMSE denominator is 4.04.
ErrorFigures figuresOf(const Truth& truth, int seeds, std::uint64_t trial) {
  Noise noise(trial);
  std::vector<Frame> frames;
  for (int i = 0; i < seeds; ++i)
    frames.push_back(frameOf(2 + truth.bias, truth.sigma, noise));
  const Frame reference = frameOf(2, truth.referenceSigma, noise);
  const Frame variance(3, std::vector<float>(kPixels, truth.referenceSigma * truth.referenceSigma));
  return errorFigures(planes(frames), planes(reference), planes(variance), {});
}

TEST(StudentT, quantilesAreThoseOfTheTables) {
  EXPECT_NEAR(studentT95(1), 12.706, 1e-3);
  EXPECT_NEAR(studentT95(4), 2.776, 1e-3);
  EXPECT_NEAR(studentT95(30), 2.042, 1e-3);
  EXPECT_NEAR(studentT95(40), 2.021, 1e-3);
  EXPECT_NEAR(studentT95(1'000'000), 1.95996, 1e-4);
}

TEST(Spread, isTheMedianAndTheEnds) {
  EXPECT_EQ(spreadOf({5, 1, 3}).median, 3);
  EXPECT_EQ(spreadOf({4, 1, 2, 9}).median, 3);
  EXPECT_EQ(spreadOf({4, 1, 2, 9}).max, 9);
  EXPECT_EQ(spreadOf({}).median, 0);
}

TEST(MeanEstimate, isATInterval) {
  const std::vector<double> values{1, 2, 3, 4, 5};
  const Estimate e = meanEstimate(values);
  EXPECT_DOUBLE_EQ(e.value, 3);
  EXPECT_NEAR(e.high - 3, 2.776 * std::sqrt(2.5 / 5), 1e-9);
  EXPECT_NEAR(3 - e.low, e.high - 3, 1e-12);
}

// Means over many trials: neither noise of few seeds nor of the reference shifts them.
TEST(ErrorFigures, areUnbiasedForFewSeedsAndANoisyReference) {
  for (const float referenceSigma : {0.0f, 0.1f}) {
    const Truth truth{0.2f, 0.3f, referenceSigma};
    double bias = 0, variance = 0, error = 0;
    constexpr int kTrials = 60;
    for (int t = 0; t < kTrials; ++t) {
      const ErrorFigures f = figuresOf(truth, 3, static_cast<std::uint64_t>(t));
      bias += f.biasSquared.value / kTrials;
      variance += f.variance.value / kTrials;
      error += f.relMse.value / kTrials;
    }
    // A noisy denominator shifts all of them alike, by a few per cent at a noise of 5 %.
    const double loose = referenceSigma > 0 ? 0.05 : 0.02;
    EXPECT_NEAR(bias, 0.04 / 4.04, loose * 0.13 / 4.04);
    EXPECT_NEAR(variance, 0.09 / 4.04, loose * 0.13 / 4.04);
    EXPECT_NEAR(error, 0.13 / 4.04, loose * 0.13 / 4.04);
  }
}

TEST(ErrorFigures, biasAndVarianceAddUpToTheError) {
  const ErrorFigures f = figuresOf({}, 5, 7);
  EXPECT_NEAR(f.relMse.value, f.biasSquared.value + f.variance.value, 1e-12);
  EXPECT_NEAR(f.meanRatio.value, 1.1, 0.01);
}

TEST(ErrorFigures, intervalsHoldTheTruthAboutNineteenTimesInTwenty) {
  int bias = 0, variance = 0, error = 0;
  constexpr int kTrials = 400;
  for (int t = 0; t < kTrials; ++t) {
    const ErrorFigures f = figuresOf({}, 5, 1000 + static_cast<std::uint64_t>(t));
    bias += f.biasSquared.low <= 0.04 / 4.04 && 0.04 / 4.04 <= f.biasSquared.high;
    variance += f.variance.low <= 0.09 / 4.04 && 0.09 / 4.04 <= f.variance.high;
    error += f.relMse.low <= 0.13 / 4.04 && 0.13 / 4.04 <= f.relMse.high;
  }
  // Four standard deviations of a binomial count.
  for (const int count : {bias, variance, error})
    EXPECT_NEAR(count, 0.95 * kTrials, 4 * std::sqrt(0.95 * 0.05 * kTrials));
}

TEST(ErrorFigures, relMseIsThatOfImageMeasure) {
  Noise noise(3);
  const Frame a = frameOf(2, 0.3f, noise), b = frameOf(2.5f, 0.2f, noise);
  const Frame reference = frameOf(2, 0.5f, noise);
  std::vector<unsigned char> mask(kPixels, 1);
  for (std::size_t i = 0; i < kPixels; i += 3)
    mask[i] = 0;
  image::MeasureOptions options;
  options.mask = mask;
  const auto measured = [&](const Frame& f) {
    return image::measure(planes(f), planes(reference), static_cast<int>(kPixels), Vec2i(0),
                          options)
        .relMse;
  };
  const Frame zero(3, std::vector<float>(kPixels, 0));
  const ErrorFigures f =
      errorFigures({planes(a), planes(b)}, planes(reference), planes(zero), mask);
  EXPECT_NEAR(f.relMse.value, 0.5 * (measured(a) + measured(b)), 1e-12);
  EXPECT_NEAR(image::relativeProduct(planes(a), planes(a), planes(reference), mask), measured(a),
              1e-12);
}

}  // namespace
}  // namespace photosphere::study
