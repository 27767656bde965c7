// Directions, falloff, limits and options of each light.
#include <cmath>

#include "fixture.h"
#include "photosphere/core/error.h"

namespace photosphere::lights {
namespace {

const BoundingSphere unitSphere{{0, 0, 0}, 1};

double emissionTail(const Light& light, const BoundingSphere& bounds, const Vec3d& axis,
                    double cosine, std::uint64_t seed) {
  const double density = 1 / (2 * kPi * (1 - cosine));
  return test::directionChiSquared(
      [&](const Vec2f& u) {
        return light.emit(bounds, {u.x, u.y, 0.5f, 0.5f}).direction;
      },
      [&](const Vec3f& w) { return glm::dot(Vec3d(w), axis) > cosine ? density : 0.0; }, 200000,
      seed);
}

TEST(Emission, FillsItsSetOfDirectionsEvenly) {
  EXPECT_GT(emissionTail(*makeLight("point", {{"position", "[0, 0.5, 0]"}}), unitSphere, {0, 0, 1},
                         -1, 1),
            1e-4);
  EXPECT_GT(emissionTail(*makeLight("environment", {}), unitSphere, {0, 0, 1}, -1, 2), 1e-4);
  // Cones about the pole, whose edges lie on the cells of the test: cosines that are multiples of
  // 1/20.
  EXPECT_GT(emissionTail(*makeLight("point", {{"position", "[0, 0, -1.25]"}}), unitSphere,
                         {0, 0, 1}, 0.6, 3),
            1e-4);
  const double degrees = std::acos(-0.5) * 180 / kPi;
  EXPECT_GT(emissionTail(*makeLight("spot", {{"position", "[0, 0, -0.5]"},
                                             {"cone_angle", std::to_string(degrees)}}),
                         unitSphere, {0, 0, 1}, -0.5, 4),
            1e-4);
}

TEST(Spot, FallsOffAsTheSceneContractSays) {
  for (const auto& [angle, edge] : std::vector<std::pair<double, double>>{
           {20, 0}, {20, 5}, {20, 20}, {10, 30}, {179.9, 90}, {180, 0}, {0.01, 0.003}}) {
    const auto light = makeLight("spot", {{"position", "[0, 0, 0]"},
                                          {"target", "[0, 0, -1]"},
                                          {"intensity", "3"},
                                          {"cone_angle", std::to_string(angle)},
                                          {"cone_edge", std::to_string(edge)}});
    for (int i = 0; i <= 300; ++i) {
      const double theta = std::min(180.0, (i + 0.37) / 240 * angle);
      const double r = theta * kPi / 180;
      const Vec3f p(2 * std::sin(r), 0, -2 * std::cos(r));
      const double t = edge > 0 ? std::min(1.0, std::max(0.0, (angle - theta) / edge))
                                : (theta <= angle ? 1.0 : 0.0);
      ASSERT_NEAR(static_cast<double>(light->illuminate(p, {}).irradiance.g),
                  3 * t * t * (3 - 2 * t) / 4, 2e-6)
          << angle << ' ' << edge << ' ' << theta;
    }
  }
}

// Random spots, spheres and edges: the integral behind power() against a plain Monte Carlo estimate
// that shares no code with it.
TEST(Spot, PowerIsTheSharedIntegral) {
  Rng rng(RandomKey::fromSeed(8, 0), RandomStream::test, 0);
  auto between = [&](double a, double b) { return a + (b - a) * rng.uniformDouble(); };
  for (int trial = 0; trial < 12; ++trial) {
    const double angle = between(10, 170),
                 edge = trial % 3 ? std::min(180.0, between(1, 1.2 * angle)) : 0.0;
    const Vec3d position(between(-2, 2), between(-2, 2), between(-2, 2));
    const auto text = [](const Vec3d& v) { return fmt::format("[{}, {}, {}]", v.x, v.y, v.z); };
    const auto light = makeLight("spot", {{"position", text(position)},
                                          {"target", "[0.3, 0.2, -0.1]"},
                                          {"cone_angle", fmt::format("{}", angle)},
                                          {"cone_edge", fmt::format("{}", edge)}});
    const Vec3d axis = glm::normalize(Vec3d(0.3, 0.2, -0.1) - position);
    const bool inside = glm::length(position) < 1;
    Mean mean;
    for (int i = 0; i < 200000; ++i) {
      const Vec3d w(sampleSphere(rng.uniform2()));
      const double along = -glm::dot(position, w);
      const bool meets = inside || (along > 0 && glm::length(position + along * w) < 1);
      const double theta = std::acos(glm::clamp(glm::dot(w, axis), -1.0, 1.0)) * 180 / kPi;
      const double t =
          edge > 0 ? glm::clamp((angle - theta) / edge, 0.0, 1.0) : (theta <= angle ? 1.0 : 0.0);
      mean.add(meets ? 4 * kPi * t * t * (3 - 2 * t) : 0.0);
    }
    EXPECT_NEAR(static_cast<double>(light->power(unitSphere).r), mean.mean(),
                4.5 * mean.error() + 1e-6)
        << angle << ' ' << edge << ' ' << text(position);
  }
}

TEST(Spot, HasClosedFormPowers) {
  // Sphere wholly inside the cone: the solid angle of the sphere. Light inside: that of the cone.
  const double sphere = 2 * kPi * (1 - std::sqrt(1 - 1.0 / 16));
  EXPECT_NEAR(
      makeLight("spot", {{"position", "[0, 4, 0]"}, {"cone_angle", "40"}})->power(unitSphere).r /
          sphere,
      1.0, 1e-6);
  EXPECT_NEAR(
      makeLight("spot", {{"position", "[0, 0.5, 0]"}, {"cone_angle", "60"}})->power(unitSphere).r /
          kPi,
      1.0, 1e-6);
  // Far and narrow: pi R^2 / d^2, which 1 - cos in double would lose.
  EXPECT_NEAR(
      makeLight("spot", {{"position", "[0, 1e8, 0]"}, {"cone_angle", "1"}})->power(unitSphere).r /
          (kPi * 1e-16),
      1.0, 1e-6);
  EXPECT_EQ(
      makeLight("spot", {{"position", "[0, 4, 0]"}, {"target", "[0, 9, 0]"}})->power(unitSphere),
      Rgb(0));
}

TEST(Power, OfTheOtherLightsIsTheirClosedForm) {
  const BoundingSphere bounds{{1, 0, 0}, 2};
  const auto power = [&](const char* type, const Options& options) {
    return static_cast<double>(makeLight(type, options)->power(bounds).r);
  };
  EXPECT_NEAR(power("point", {{"position", "[0, 0, 1]"}}) / (4 * kPi), 1.0, 1e-6);
  EXPECT_NEAR(power("point", {{"position", "[5, 0, 0]"}}) / (2 * kPi * (1 - std::sqrt(0.75))), 1.0,
              1e-6);
  EXPECT_NEAR(power("directional", {{"intensity", "3"}}) / (3 * 4 * kPi), 1.0, 1e-6);
  EXPECT_NEAR(power("environment", {{"intensity", "0.5"}}) / (0.5 * 4 * kPi * 4 * kPi), 1.0, 1e-6);
}

TEST(Limits, IlluminationIsFiniteAtAndAroundTheLight) {
  for (const char* type : {"point", "spot"}) {
    Options options{{"position", "[0, 0, 0]"}};
    if (std::string(type) == "spot") options.emplace_back("target", "[1, 0, 0]");
    const auto light = makeLight(type, options);
    const Illumination at = light->illuminate({0, 0, 0}, {});
    EXPECT_EQ(at.irradiance, Rgb(0)) << type;
    EXPECT_NEAR(glm::length(at.direction), 1.0f, 1e-6f);
    for (float d : {1e-30f, 1e-12f, 1e-3f}) {
      const Illumination near = light->illuminate({d, 0, 0}, {});
      EXPECT_TRUE(std::isfinite(near.irradiance.r)) << type << ' ' << d;
      EXPECT_GT(near.irradiance.r, 0.0f) << type << ' ' << d;
      EXPECT_NEAR(near.direction.x, 1.0f, 1e-6f);
    }
  }
}

TEST(Limits, SoftLightsTakeNoPowerToEmptyBounds) {
  for (const char* type : {"point", "spot"}) {
    const auto light = makeLight(type, {{"radius", "0.5"}});
    EXPECT_EQ(light->power({{1, 2, 3}, 0}), Rgb(0)) << type;
    const Emission photon = light->emit({{1, 2, 3}, 0}, Vec4f(0.5f));
    EXPECT_EQ(photon.power, Rgb(0)) << type;
    EXPECT_NEAR(glm::length(photon.direction), 1.0f, 1e-6f) << type;
  }
}

TEST(Limits, EmptyBoundsTakeNoPower) {
  const BoundingSphere none{{1, 2, 3}, 0};
  for (const LightPlugin* plugin : lightModels()) {
    const auto light = makeLight(std::string(plugin->name), {});
    EXPECT_EQ(light->power(none), Rgb(0)) << plugin->name;
    const Emission photon = light->emit(none, Vec4f(0.5f));
    EXPECT_EQ(photon.power, Rgb(0)) << plugin->name;
    EXPECT_NEAR(glm::length(photon.direction), 1.0f, 1e-6f) << plugin->name;
  }
}

// A light far away: the photons must not sit on the lattice of float directions.
TEST(Limits, PhotonsOfAFarLightSpreadEvenly) {
  const auto light = makeLight("point", {{"position", "[6e7, 7e7, -4e7]"}});
  const Vec3d axis = glm::normalize(Vec3d(-6, -7, 4));
  const Frame frame = Frame::fromZ(Vec3f(axis));
  Rng rng(RandomKey::fromSeed(9, 0), RandomStream::test, 0);
  constexpr int cells = 20, count = 200000;
  std::vector<double> rings(cells, 0.0);
  for (int i = 0; i < count; ++i) {
    const Emission photon = light->emit(unitSphere, uniform4(rng));
    const Vec3d d = glm::normalize(Vec3d(photon.direction));
    const Vec3d closest = photon.origin - d * glm::dot(photon.origin, d);
    const double area = glm::dot(closest, closest);
    rings[static_cast<std::size_t>(glm::clamp(static_cast<int>(area * cells), 0, cells - 1))] += 1;
    ASSERT_LT(std::abs(glm::dot(closest, Vec3d(frame.x))), 1.001);
  }
  double statistic = 0;
  for (double n : rings)
    statistic += (n - count / cells) * (n - count / cells) / (count / cells);
  EXPECT_GT(test::chiSquaredTail(statistic, cells - 1), 1e-4);
}

TEST(LocalSpaces, PositionsAreMetresFromTheSmokesCentre) {
  const LocalSpace space{{1e6, 0, 0}, 0.01};  // centimetres, a long way off
  const auto light =
      makeLight("point", {{"position", "[1000300, 0, 0]"}, {"intensity", "9"}}, space);
  const Illumination at = light->illuminate({0, 0, 0}, {});
  EXPECT_NEAR(at.distance, 3.0f, 1e-6f);
  EXPECT_NEAR(at.irradiance.r, 1.0f, 1e-6f);
  EXPECT_NEAR(at.direction.x, -1.0f, 1e-6f);
}

TEST(Directional, ShinesFromPositionToTarget) {
  const auto light = makeLight(
      "directional", {{"position", "[0, 5, 0]"}, {"target", "[0, 1, 0]"}, {"color", "[1, 2, 3]"}},
      {{10, 20, 30}, 0.01});
  const Illumination at = light->illuminate({4, 5, 6}, {});
  EXPECT_EQ(at.direction, Vec3f(0, -1, 0));
  EXPECT_EQ(at.irradiance, Rgb(1, 2, 3));
  EXPECT_EQ(at.distance, kInfinity);
  EXPECT_FALSE(light->isGrey());
  const Emission photon = light->emit(unitSphere, {0.9f, 0.3f, 0, 0});
  EXPECT_GE(glm::length(photon.origin), 1.0);
  EXPECT_NEAR(photon.origin.y, 1.0, 1e-12);
}

TEST(Options, AreCheckedAndForeignOnesRefused) {
  EXPECT_THROW(makeLight("point", {{"cone_angle", "3"}}), ConfigError);
  EXPECT_THROW(makeLight("point", {{"size", "[1, 1]"}}), ConfigError);
  EXPECT_THROW(makeLight("environment", {{"position", "[1, 1, 1]"}}), ConfigError);
  EXPECT_THROW(makeLight("rect", {{"size", "[0, 1]"}}), ConfigError);
  EXPECT_THROW(makeLight("disk", {{"radius", "0"}}), ConfigError);
  EXPECT_THROW(makeLight("sphere", {{"radius", "-1"}}), ConfigError);
  EXPECT_THROW(makeLight("spot", {{"radius", "-0.5"}}), ConfigError);
  EXPECT_THROW(makeLight("spot", {{"cone_angle", "181"}}), ConfigError);
  EXPECT_THROW(makeLight("spot", {{"cone_angle", "0"}}), ConfigError);
  EXPECT_THROW(makeLight("spot", {{"intensity", "-1"}}), ConfigError);
  EXPECT_THROW(makeLight("spot", {{"color", "[1, -1, 1]"}}), ConfigError);
  EXPECT_THROW(makeLight("spot", {{"position", "[0, 0, 0]"}}), ConfigError);
  EXPECT_THROW(makeLight("directional", {{"position", "[0, 0, 0]"}}), ConfigError);
  EXPECT_NO_THROW(makeLight("point", {{"position", "[0, 0, 0]"}, {"radius", "0"}}));
  EXPECT_EQ(ParamValues(lightParams()).text("name"), "key");
}

TEST(Options, OnlyWithoutExtentIsDelta) {
  for (const LightPlugin* plugin : lightModels()) {
    const auto light = makeLight(std::string(plugin->name), {});
    const bool extended = plugin->name == "environment" || plugin->name == "rect" ||
                          plugin->name == "disk" || plugin->name == "sphere";
    EXPECT_EQ(light->isDelta(), !extended) << plugin->name;
    EXPECT_TRUE(light->isGrey()) << plugin->name;
    EXPECT_FALSE(plugin->help.empty());
  }
  for (const char* type : {"point", "spot"}) {
    EXPECT_TRUE(makeLight(type, {{"radius", "0"}})->isDelta()) << type;
    EXPECT_FALSE(makeLight(type, {{"radius", "0.2"}})->isDelta()) << type;
    EXPECT_TRUE(makeLight(type, {{"radius", "1e-12"}})->isDelta()) << "less than rounding";
  }
}

// A soft point or spot lights a point as the sharp one does, from every direction of its body: the
// mean over a small plate that faces it is I falloff / d^2, and the edge of the cone spreads.
TEST(SoftLights, KeepTheirIntensity) {
  const auto mean = [](const Light& light, const Vec3f& p) {
    const Vec3d normal = glm::normalize(Vec3d(p));
    double sum = 0;
    constexpr int n = 200;
    for (int i = 0; i < n * n; ++i) {
      const Illumination in = light.illuminate(
          p, {(static_cast<float>(i % n) + 0.5f) / n, (static_cast<float>(i / n) + 0.5f) / n});
      sum += static_cast<double>(in.irradiance.g) * glm::dot(Vec3d(in.direction), normal) / (n * n);
    }
    return sum;
  };
  const auto point =
      makeLight("point", {{"position", "[0, 0, 0]"}, {"intensity", "3"}, {"radius", "0.5"}});
  for (const double d : {0.6, 1.0, 7.0, 1000.0}) {
    const Vec3f p(Vec3d(0.6, 0, -0.8) * d);
    EXPECT_NEAR(mean(*point, p) / (3 / (d * d)), 1, 3e-4) << d;
  }
  EXPECT_EQ(point->illuminate({0.2f, 0, 0}, {0.3f, 0.4f}).irradiance.g, 0.0f) << "dark inside";
  EXPECT_NEAR(static_cast<double>(point->illuminate({0, 2, 0}, {0.0f, 0.5f}).distance), 1.5, 1e-6);

  const auto spot = [](const char* radius, const char* edge) {
    return makeLight("spot", {{"position", "[0, 0, 0]"},
                              {"target", "[0, 0, -1]"},
                              {"intensity", "3"},
                              {"cone_angle", "20"},
                              {"cone_edge", edge},
                              {"radius", radius}});
  };
  const auto at = [](double degrees, double d) {
    const double theta = degrees * kPi / 180;
    return Vec3f(d * Vec3d(std::sin(theta), 0, -std::cos(theta)));
  };
  const auto hard = spot("0.1", "0"), edged = spot("0.1", "12");
  for (const double d : {3.0, 500.0}) {
    EXPECT_NEAR(mean(*hard, at(0, d)) / (3 / (d * d)), 1, 3e-4) << d;
    EXPECT_NEAR(mean(*hard, at(15, d)) / (3 / (d * d)), 1, 3e-4) << d;
    EXPECT_EQ(mean(*hard, at(25, d)), 0) << d;
    // Smoothstep is a half, and odd about it, in the middle of the edge.
    EXPECT_NEAR(mean(*edged, at(14, d)) / (1.5 / (d * d)), 1, d < 10 ? 0.012 : 1e-3) << d;
  }
  // On the edge half of the body is seen in its cone: a narrow penumbra replaces the jump.
  EXPECT_NEAR(mean(*hard, at(20, 5)) * 25 / 3, 0.5, 0.02);
  EXPECT_GT(mean(*hard, at(20.5, 5)), 0);
  EXPECT_GT(mean(*hard, at(19.5, 5)), mean(*hard, at(20.5, 5)));
  EXPECT_EQ(mean(*hard, at(22, 5)), 0);
  // A cone far narrower than the body: drawn from the cone, and still I / d^2 on the axis over a
  // plate that its light fills.
  const auto narrow = makeLight("spot", {{"position", "[0, 0, 0]"},
                                         {"target", "[0, 0, -1]"},
                                         {"cone_angle", "0.5"},
                                         {"radius", "1"}});
  const double cone = 2 * kPi * (1 - std::cos(0.5 * kPi / 180));
  EXPECT_NEAR(mean(*narrow, {0, 0, -5}) / (cone / kPi), 1, 3e-4);
}

// Irradiance behind a disc's axis and before a ball, at any distance: the textbook's closed forms.
TEST(AreaLights, IlluminateAsTheClosedFormsSay) {
  const auto mean = [](const Light& light, const Vec3f& p, const Vec3d& normal) {
    double sum = 0;
    constexpr int n = 1000;  // the rim of a disk cuts cells of the lattice
    for (int i = 0; i < n * n; ++i) {
      const Illumination in = light.illuminate(
          p, {(static_cast<float>(i % n) + 0.5f) / n, (static_cast<float>(i / n) + 0.5f) / n});
      sum += static_cast<double>(in.irradiance.g) *
             std::max(0.0, -glm::dot(Vec3d(in.direction), normal)) / (n * n);
    }
    return sum;
  };
  for (const double d : {0.5, 1.0, 3.0, 40.0}) {
    const double sine2 = 1 / (1 + d * d);  // of the half angle of a disc of radius 1
    const auto disk = makeLight(
        "disk",
        {{"position", "[0, 0, 0]"}, {"target", "[0, 0, 1]"}, {"radius", "1"}, {"intensity", "2"}});
    EXPECT_NEAR(mean(*disk, Vec3f(0, 0, d), {0, 0, -1}) / (2 * kPi * sine2), 1, 2e-4) << d;
    EXPECT_EQ(mean(*disk, Vec3f(0, 0, -d), {0, 0, 1}), 0) << "it shines to one side";
    const auto ball =
        makeLight("sphere", {{"position", "[0, 0, 0]"}, {"radius", "1"}, {"intensity", "2"}});
    EXPECT_NEAR(mean(*ball, Vec3f(0, 0, 1 + d), {0, 0, -1}) / (2 * kPi / ((1 + d) * (1 + d))), 1,
                2e-4)
        << d;
    const Illumination in = ball->illuminate(Vec3f(0, 0, 1 + d), {0.0f, 0.5f});
    EXPECT_NEAR(static_cast<double>(in.distance), d, 1e-6 * (1 + d)) << "to the surface";
  }
  EXPECT_EQ(makeLight("sphere", {{"position", "[0, 0, 0]"}, {"radius", "1"}})
                ->illuminate({0.2f, 0, 0}, {0.3f, 0.4f})
                .irradiance.g,
            0.0f)
      << "dark inside";
}

TEST(AreaLights, ARectLiesLevel) {
  const auto light =
      makeLight("rect", {{"position", "[0, 5, 0]"}, {"target", "[0, 5, 1]"}, {"size", "[4, 2]"}});
  const BoundingSphere far{{0, 5, 1000}, 1};
  Vec3d low(1e9), high(-1e9);
  for (int i = 0; i < 100; ++i) {
    const float a = (static_cast<float>(i % 10) + 0.5f) / 10,
                b = (static_cast<float>(i / 10) + 0.5f) / 10;
    const Emission photon = light->emit({{0, 5, 20}, 1}, {a, b, 0.5f, 0.5f});
    low = glm::min(low, photon.origin);
    high = glm::max(high, photon.origin);
  }
  EXPECT_NEAR(high.x - low.x, 4 * 0.9, 1e-5);
  EXPECT_NEAR(high.y - low.y, 2 * 0.9, 1e-5);
  EXPECT_NEAR(high.z, low.z, 1e-9);
  EXPECT_NEAR(static_cast<double>(light->power(far).g), 8 * kPi / 1e6, 1e-3 * 8 * kPi / 1e6);
}

}  // namespace
}  // namespace photosphere::lights
