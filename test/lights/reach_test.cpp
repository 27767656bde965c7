// What a plan relies on: no point of the sphere gets more light, or from elsewhere, than `reach`
// says, and where it says nothing, nothing comes.
#include <algorithm>

#include "fixture.h"
#include "photosphere/image/exr.h"

namespace photosphere::lights {
namespace {

struct ReachCase {
  const char* label;
  const char* type;
  Options options;
  BoundingSphere bounds;
  double tight;  // the bound is at most this many times the most that was met
};

void PrintTo(const ReachCase& c, std::ostream* out) {
  *out << c.label;
}

class LightReach : public ::testing::TestWithParam<ReachCase> {};

TEST_P(LightReach, HoldsEverywhereInTheSphere) {
  const ReachCase& c = GetParam();
  const auto light = makeLight(c.type, c.options);
  const Reach reach = light->reach(c.bounds);
  Rng rng(RandomKey::fromSeed(3, 0), RandomStream::test, 1);
  const int points = 400, samples = light->isDelta() ? 1 : 256;
  double most = 0;
  for (int i = 0; i < points; ++i) {
    // On the surface of the sphere the extremes are met.
    const Vec3d p = c.bounds.center + c.bounds.radius * Vec3d(sampleSphere(rng.uniform2())) *
                                          (i % 2 ? 1.0 : std::cbrt(rng.uniformDouble()));
    double sum = 0;
    for (int k = 0; k < samples; ++k) {
      const Vec2f u((static_cast<float>(k % 16) + 0.5f) / 16,
                    (static_cast<float>(k / 16) + 0.5f) / 16);
      const Illumination in = light->illuminate(Vec3f(p), u);
      const double irradiance = static_cast<double>(maxComponent(in.irradiance));
      sum += irradiance / samples;
      if (!(irradiance > 0)) continue;
      const Vec3d d = Vec3d(in.direction) - reach.axis;
      EXPECT_LE(0.5 * glm::dot(d, d), reach.oneMinusCos + 1e-5);
    }
    most = std::max(most, sum);
    EXPECT_LE(static_cast<double>(maxComponent(light->background(sampleSphere(rng.uniform2())))),
              reach.background);
  }
  EXPECT_LE(most, reach.fluence * (1 + 1e-4));
  EXPECT_LE(reach.fluence, c.tight * most);
}

const ReachCase kReachCases[] = {
    {"point", "point", {{"position", "[5, 0, 0]"}, {"color", "[1, 3, 2]"}}, {Vec3d(0), 1}, 1.5},
    {"spot", "spot", {{"position", "[5, 0, 0]"}, {"cone_edge", "5"}}, {Vec3d(0, 1, 0), 1}, 1.5},
    {"spot_at_its_edge",
     "spot",
     {{"position", "[0, 0, 10]"}, {"cone_angle", "20"}, {"cone_edge", "10"}},
     {Vec3d(3.5, 0, 0), 1},
     4},
    {"spot_that_misses", "spot", {{"position", "[0, 0, 10]"}}, {Vec3d(8, 0, 0), 1}, 1},
    {"directional", "directional", {{"intensity", "4"}}, {Vec3d(1, 2, 3), 2}, 1.001},
    {"environment", "environment", {{"intensity", "2"}}, {Vec3d(1, 2, 3), 2}, 1.001},
    {"dark_environment", "environment", {{"intensity", "0"}}, {Vec3d(0), 2}, 1},
    {"rect", "rect", {{"position", "[0, 0, 6]"}, {"size", "[2, 1]"}}, {Vec3d(0), 1}, 3},
    {"rect_behind", "rect", {{"position", "[0, 0, 6]"}}, {Vec3d(0, 0, 9), 1}, 1},
    {"disk", "disk", {{"position", "[0, 4, 0]"}, {"radius", "2"}}, {Vec3d(0), 1}, 20},
    {"sphere", "sphere", {{"position", "[4, 0, 0]"}, {"radius", "1"}}, {Vec3d(0), 1}, 12},
    {"point_inside", "point", {{"position", "[0.2, 0, 0]"}}, {Vec3d(0), 1}, 1e300},
    {"soft_point", "point", {{"position", "[4, 0, 0]"}, {"radius", "0.5"}}, {Vec3d(0), 1}, 12},
    {"soft_spot", "spot", {{"position", "[4, 0, 0]"}, {"radius", "0.5"}}, {Vec3d(0), 1}, 3},
    {"soft_spot_that_misses",
     "spot",
     {{"position", "[0, 0, 10]"}, {"radius", "0.5"}},
     {Vec3d(8, 0, 0), 1},
     1},
    {"sphere_around", "sphere", {{"position", "[0, 0, 2]"}, {"radius", "2"}}, {Vec3d(0), 1}, 20},
};

INSTANTIATE_TEST_SUITE_P(All, LightReach, ::testing::ValuesIn(kReachCases),
                         [](const auto& row) { return std::string(row.param.label); });

TEST(LightReach, OfAPictureHoldsBetweenItsPixels) {
  test::TemporaryFolder folder;
  const std::string path = (folder / "sky.exr").string();
  image::Image sky({0, 0, 16, 8}, {0, 0, 16, 8});
  sky.addLayer("", image::ChannelKind::color);
  // A sun beside the pole, whose light reaches into the wider rows below it.
  for (const char* name : {"R", "G", "B"})
    sky.channel(name)[5] = 50.0f;
  sky.channel("B")[60] = 3.0f;
  image::writeExr(path, sky, {}, {.floatColor = true});
  const auto light = makeLight("environment", {{"file", path}});
  const Reach reach = light->reach({Vec3d(0), 1});
  double fluence = 0, brightest = 0;
  const int n = 400;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < 2 * n; ++x) {
      const double cosine = 1 - 2 * (y + 0.5) / n, sine = std::sqrt(1 - cosine * cosine);
      const double phi = kPi * (x + 0.5) / n;
      const double value = static_cast<double>(maxComponent(
          light->background(Vec3f(Vec3d(sine * std::cos(phi), cosine, sine * std::sin(phi))))));
      fluence += value * 4 * kPi / (2.0 * n * n);
      brightest = std::max(brightest, value);
    }
  EXPECT_GT(fluence, 0);
  EXPECT_LE(fluence, reach.fluence);
  EXPECT_LE(brightest, reach.radiance);
  EXPECT_LE(reach.radiance, 1.1 * brightest);
}

}  // namespace
}  // namespace photosphere::lights
