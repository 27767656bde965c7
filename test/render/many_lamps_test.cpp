// Hundreds of lamps: a few are drawn for each point, and their mean is the sum over all.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "support/frames.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

constexpr int kLamps = 150;

transport::Medium unevenSmoke() {
  return makeMedium(sampledVolume(2.0, 24, {0.8, 0.3, 3.0}, [](const Vec3d& p) {
    return std::max(0.0, 1 - glm::length(p - Vec3d(0.3, 0.1, -0.2)));
  }));
}

// Inside the smoke, around it and far away, of powers that differ a thousandfold; every third is a
// narrow spot that most of the smoke is out of.
std::vector<std::unique_ptr<lights::Light>> lamps(int first, int last) {
  std::vector<std::unique_ptr<lights::Light>> all;
  for (int i = first; i < last; ++i) {
    Rng rng(RandomKey::fromSeed(3, 0), RandomStream::test, static_cast<std::uint64_t>(i));
    const Vec3d at =
        Vec3d(sampleSphere(rng.uniform2())) * (0.3 + 4 * static_cast<double>(rng.uniform()));
    const double intensity = std::pow(10, 3 * static_cast<double>(rng.uniform()) - 2);
    std::vector<std::pair<std::string, std::string>> options{
        {"position", fmt::format("[{}, {}, {}]", at.x, at.y, at.z)},
        {"intensity", fmt::format("{}", intensity)}};
    if (i % 3 == 0) {
      options.push_back({"target", "[0, 0, 0]"});
      options.push_back({"cone_angle", "15"});
    }
    all.push_back(makeLight(i % 3 == 0 ? "spot" : "point", options));
  }
  return all;
}

struct Look {
  Vec3d origin;
  Vec3f direction;
};
const Look kLooks[] = {{{-9, 0.1, 0.2}, {1, 0, 0}}, {{0.3, 9, -0.4}, {0, -1, 0}}};

double meanSingle(const render::Integrator& integrator, const Look& look, int rays) {
  render::IntegratorCounters counters;
  double sum = 0;
  for (int i = 0; i < rays; ++i) {
    Rng rng(RandomKey::fromSeed(5, 0), RandomStream::camera, static_cast<std::uint64_t>(i));
    sum += static_cast<double>(
        integrator.radiance(look.origin, look.direction, {}, rng, counters).single.x);
  }
  return sum / rays;
}

// One by one every lamp is asked for.
double sumOverLamps(const transport::Medium& medium, const Look& look) {
  double sum = 0;
  for (int i = 0; i < kLamps; ++i) {
    const transport::LightList one = lamps(i, i + 1);
    const render::Shadows shadows(medium, one, render::ShadowMode::march, 0.02f, 0);
    const auto march = render::makeMarchIntegrator(medium, one, shadows, nullptr, {});
    sum += meanSingle(*march, look, 4);
  }
  return sum;
}

TEST(ManyLamps, AreSummedByDrawingAFew) {
  const transport::Medium medium = unevenSmoke();
  const transport::LightList all = lamps(0, kLamps);
  const render::Shadows shadows(medium, all, render::ShadowMode::grid, 0.02f, 0);
  EXPECT_EQ(shadows.memoryBytes(), 0u);
  const auto march = render::makeMarchIntegrator(medium, all, shadows, nullptr, {});
  const auto paths = render::makePathIntegrator(medium, all, {});
  for (const Look& look : kLooks) {
    const double exact = sumOverLamps(medium, look);
    ASSERT_GT(exact, 0.0);
    EXPECT_NEAR(meanSingle(*march, look, 2000) / exact, 1.0, 0.01);
    EXPECT_NEAR(meanSingle(*paths, look, 400000) / exact, 1.0, 0.03);
  }
}

}  // namespace
}  // namespace photosphere::test
