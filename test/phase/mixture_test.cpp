// Draine lobes and mixtures against their own closed forms, quadrature and chi-squared tests.
#include <algorithm>
#include <cmath>
#include <vector>

#include "photosphere/core/error.h"
#include "photosphere/core/registry.h"
#include "photosphere/core/rng.h"
#include "photosphere/phase/phase.h"
#include "support/support.h"

namespace photosphere::phase {
namespace {

// Density of the cosine, in long double [1/sr].
long double reference(const Draine& lobe, long double c) {
  const long double g = lobe.g(), a = lobe.alpha(), d = 1 + g * g - 2 * g * c;
  return (1 - g * g) * (1 + a * c * c) /
         (4 * static_cast<long double>(kPi) * d * std::sqrt(d) * (1 + a * (1 + 2 * g * g) / 3));
}

// Its integral over the sphere from the peak's side to t = 1 - s c, by Gauss's rule of 3 nodes in
// panels that are even in ln(t + c0).
template <class Weight>
double integral(const Draine& lobe, double t, const Weight& weightOf) {
  const double side = lobe.g() < 0 ? -1 : 1, c0 = std::pow(1 - std::abs(lobe.g()), 2) / 2 + 1e-9;
  const double low = std::log(c0), width = (std::log(t + c0) - low) / 400;
  double sum = 0;
  for (int i = 0; i < 400; ++i)
    for (int k = -1; k <= 1; ++k) {
      const double e = std::exp(low + (i + 0.5 + 0.3872983346207417 * k) * width);
      const double weight = k ? 5.0 / 18 : 8.0 / 18;
      const double cosine = side * (1 - (e - c0));
      sum += weight * width * e * 2 * kPi * weightOf(cosine) *
             static_cast<double>(reference(lobe, cosine));
    }
  return sum;
}

double cumulative(const Draine& lobe, double t) {
  return integral(lobe, t, [](double) { return 1.0; });
}

struct Shape {
  double g, alpha;
};

class DraineLobe : public ::testing::TestWithParam<Shape> {
 protected:
  Draine lobe() const { return Draine(GetParam().g, GetParam().alpha); }
};

TEST_P(DraineLobe, IntegratesToOneAndToItsMeanCosine) {
  const Draine phase = lobe();
  EXPECT_NEAR(cumulative(phase, 2), 1, 1e-6);
  const double moment = integral(phase, 2, [](double cosine) { return cosine; });
  EXPECT_NEAR(moment, phase.meanCosine(), 2e-6);
}

TEST_P(DraineLobe, MatchesTheClosedFormAndNeverExceedsItsMaximum) {
  const Draine phase = lobe();
  const double side = phase.g() < 0 ? -1 : 1;
  Rng rng(RandomKey::fromSeed(11, 0), RandomStream::test, 0);
  for (int i = 0; i < 20000; ++i) {
    const Vec3f wi = sampleSphere(rng.uniform2());
    const Vec3f wo = i % 2 ? sampleSphere(rng.uniform2()) : phase.sample(wi, rng.uniform2());
    const Vec3d d = glm::normalize(Vec3d(wo)) - side * glm::normalize(Vec3d(wi));
    const long double c = side * (1 - static_cast<long double>(glm::dot(d, d)) / 2);
    // The cosine has an absolute error of 1e-7, which counts where alpha cos^2 does.
    const double cosine = static_cast<double>(c), alpha = phase.alpha();
    const double slope = 2 * alpha * std::abs(cosine) / (1 + alpha * cosine * cosine);
    ASSERT_NEAR(phase.evaluate(wi, wo) / static_cast<double>(reference(phase, c)), 1.0,
                4e-6 + 3e-7 * slope)
        << i;
    ASSERT_LE(phase.evaluate(wi, wo), phase.maximum());
    ASSERT_FLOAT_EQ(phase.evaluate(wi, wo), phase.evaluate(-wo, -wi));
  }
}

// Exact where chi-squared is only statistical: what is drawn for u has probability 1 - u of being
// nearer to the peak.
TEST_P(DraineLobe, SampleInvertsTheCumulativeDistribution) {
  const Draine phase = lobe();
  const double side = phase.g() < 0 ? -1 : 1;
  const Vec3f wi(0, 0, 1);
  for (int i = 0; i < 256; ++i) {
    const float u = (static_cast<float>(i) + 0.5f) / 256.0f;
    const Vec3d wo(phase.sample(wi, {u, 0.3f}));
    EXPECT_NEAR(glm::length(wo), 1, 3e-7);
    const Vec3d d = wo - side * Vec3d(wi);
    ASSERT_NEAR(cumulative(phase, glm::dot(d, d) / 2), 1 - u, 4e-6) << u;
  }
  for (const float u : {0.0f, 0x1p-24f, 1.0f - 0x1p-24f})
    EXPECT_NEAR(glm::length(Vec3d(phase.sample(wi, {u, 0.7f}))), 1, 3e-7) << u;
}

INSTANTIATE_TEST_SUITE_P(Phase, DraineLobe,
                         ::testing::Values(Shape{0, 1}, Shape{0, 40}, Shape{1e-5, 1},
                                           Shape{2e-3, 2}, Shape{0.1, 5}, Shape{0.5, 1},
                                           Shape{-0.5, 3}, Shape{0.6, 20}, Shape{0.9, 1},
                                           Shape{0.99, 100}, Shape{0.3, 1e6}));

TEST(Rayleigh, IsTheTextbooks) {
  const PhaseFunction phase = findPlugin(phaseFunctions(), "rayleigh", "phase", "")
                                  .create(ParamValues(std::span<const Param>()));
  for (double c = -1; c <= 1; c += 0.125) {
    const Vec3f wo(Vec3d(std::sqrt(1 - c * c), 0, c));
    EXPECT_NEAR(phase.evaluate({0, 0, 1}, wo), 3 / (16 * kPi) * (1 + c * c), 1e-7) << c;
  }
  EXPECT_NEAR(phase.meanCosine(), 0, 1e-12);
}

std::vector<PhaseFunction> mixtures() {
  std::vector<PhaseFunction> all{PhaseFunction(Draine(0.6), Draine(-0.5), 0.3),
                                 PhaseFunction(Draine(0.3), Draine(0.5, 2.0), 0.7),
                                 PhaseFunction(Draine(-0.2, 1.0), Draine(0.0, 1.0), 1.0)};
  return all;
}

TEST(Mixture, SamplesFollowEvaluate) {
  std::uint64_t seed = 100;
  for (const PhaseFunction& phase : mixtures())
    for (const Vec3d& w : {Vec3d(0, 0, 1), Vec3d(1, 2, 3), Vec3d(-0.2, 0.9, -0.1)}) {
      const Vec3f wi(glm::normalize(w));
      EXPECT_GT(test::directionChiSquared([&](const Vec2f& u) { return phase.sample(wi, u); },
                                          [&](const Vec3f& wo) { return phase.evaluate(wi, wo); },
                                          200000, ++seed),
                1e-4);
    }
}

TEST(Mixture, HasTheMeanAndTheBoundOfItsLobes) {
  for (const PhaseFunction& phase : mixtures()) {
    Rng rng(RandomKey::fromSeed(41, 0), RandomStream::test, 0);
    const Vec3f wi(glm::normalize(Vec3d(3, -1, 2)));
    double sum = 0;
    constexpr int count = 200'000;
    for (int i = 0; i < count; ++i) {
      const Vec3f wo = phase.sample(wi, rng.uniform2());
      sum += static_cast<double>(glm::dot(wi, wo));
      ASSERT_LE(phase.evaluate(wi, wo), phase.maximum());
    }
    EXPECT_NEAR(sum / count, phase.meanCosine(), 4.5 / std::sqrt(count));
    for (const Vec3f& wo : {wi, -wi})
      EXPECT_LE(phase.evaluate(wi, wo), phase.maximum());
  }
}

TEST(Mixture, OfOneLobeIsThatLobe) {
  const PhaseFunction one(HenyeyGreenstein(0.4)), second(Draine(), Draine(0.4), 1.0);
  ASSERT_TRUE(second.plain());
  EXPECT_EQ(second.plain()->g(), 0.4);
  EXPECT_TRUE(one == second);
  EXPECT_EQ(second.lobes(), 1);
  EXPECT_FALSE(one == PhaseFunction(Draine(0.4, 1.0)));
  EXPECT_FALSE(PhaseFunction(Draine(0.4, 1.0)).plain());
  EXPECT_THROW(PhaseFunction(Draine(), Draine(), 1.5), ConfigError);
  EXPECT_THROW(Draine(0.0, -1.0), ConfigError);
  EXPECT_THROW(Draine(1.0, 1.0), ConfigError);
}

// Jendersie & d'Eon 2023 fit Mie theory, whose droplets scatter with mean cosines of 0.8 to 0.9.
TEST(MieFog, IsForwardAndSharperForLargerDroplets) {
  const PhasePlugin& plugin = findPlugin(phaseFunctions(), "mie_fog", "phase", "");
  double last = 0;
  for (const double diameter : {5.0, 10.0, 20.0, 50.0}) {
    ParamValues values(plugin.params);
    values.set("droplet_diameter", diameter, "");
    const PhaseFunction phase = plugin.create(values);
    EXPECT_GT(phase.meanCosine(), 0.75);
    EXPECT_LT(phase.meanCosine(), 0.95);
    EXPECT_GT(phase.maximum(), last);
    last = phase.maximum();
  }
}

}  // namespace
}  // namespace photosphere::phase
