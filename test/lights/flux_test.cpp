// Photons against illumination: what crosses a disc inside the bounding sphere, counted in photons,
// is the integral of the irradiance over the disc.
#include <cmath>
#include <string>

#include "fixture.h"

namespace photosphere::lights {
namespace {

struct Disc {
  Vec3d center, normal;
  double radius;
};

struct Case {
  const char* label;
  const char* type;
  Options options;
  BoundingSphere bounds;
  Disc disc;
  double powerOff = 1e-5;  // the most by which power() may be off
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.label;
}

bool crosses(const Emission& photon, const Disc& disc) {
  const Vec3d d = glm::normalize(Vec3d(photon.direction));
  const double along = glm::dot(d, disc.normal);
  if (along == 0) return false;
  const double t = glm::dot(disc.center - photon.origin, disc.normal) / along;
  return t > 0 && glm::length(photon.origin + d * t - disc.center) < disc.radius;
}

double photonFlux(const Light& light, const Case& c, int count, double* error) {
  Rng rng(RandomKey::fromSeed(5, 0), RandomStream::test, 0);
  Mean mean;
  for (int i = 0; i < count; ++i) {
    const Emission photon = light.emit(c.bounds, uniform4(rng));
    mean.add(crosses(photon, c.disc) ? static_cast<double>(photon.power.r) : 0.0);
  }
  *error = mean.error();
  return mean.mean();
}

// Integral over a polar lattice of the disc of irradiance times |cos|, averaged over a fine set of
// directions where the light samples them.
double irradianceFlux(const Light& light, const Disc& disc) {
  const Frame frame = Frame::fromZ(Vec3f(disc.normal));
  const int rings = 60, spokes = 90, lattice = light.isDelta() ? 1 : 24;
  double sum = 0;
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < spokes; ++j) {
      const double r = disc.radius * (i + 0.5) / rings, phi = 2 * kPi * (j + 0.5) / spokes;
      const Vec3d p =
          disc.center + Vec3d(frame.x) * (r * std::cos(phi)) + Vec3d(frame.y) * (r * std::sin(phi));
      const double area = 2 * kPi * r / spokes * disc.radius / rings;
      for (int k = 0; k < lattice * lattice; ++k) {
        const Vec2f u((static_cast<float>(k % lattice) + 0.5f) / static_cast<float>(lattice),
                      (static_cast<float>(k / lattice) + 0.5f) / static_cast<float>(lattice));
        const Illumination light0 = light.illuminate(Vec3f(p), u);
        sum += area * static_cast<double>(light0.irradiance.r) *
               std::abs(glm::dot(Vec3d(light0.direction), disc.normal)) / (lattice * lattice);
      }
    }
  return sum;
}

class Flux : public ::testing::TestWithParam<Case> {};

TEST_P(Flux, OfPhotonsIsThatOfTheIllumination) {
  const Case& c = GetParam();
  const auto light = makeLight(c.type, c.options);
  double error = 0;
  const double photons = photonFlux(*light, c, 500000, &error);
  const double expected = irradianceFlux(*light, c.disc);
  ASSERT_GT(expected, 0.0);
  EXPECT_NEAR(photons / expected, 1.0, 4.5 * error / expected + 2e-3);
  EXPECT_LT(error / expected, 0.01) << "too few photons hit for the test to mean anything";
}

// The mean power of the photons is what power() says, and no photon with power misses the sphere.
TEST_P(Flux, PhotonsCarryThePowerAndMeetTheSphere) {
  const Case& c = GetParam();
  const auto light = makeLight(c.type, c.options);
  Rng rng(RandomKey::fromSeed(6, 0), RandomStream::test, 0);
  Mean mean;
  for (int i = 0; i < 200000; ++i) {
    const Emission photon = light->emit(c.bounds, uniform4(rng));
    mean.add(static_cast<double>(photon.power.r));
    ASSERT_NEAR(glm::length(Vec3d(photon.direction)), 1.0, 2e-7);
    if (photon.power.r <= 0) continue;
    const Vec3d d(photon.direction), to = c.bounds.center - photon.origin;
    const double ahead = std::max(0.0, glm::dot(to, d));
    ASSERT_LT(glm::length(to - d * ahead), c.bounds.radius * (1 + 1e-5)) << i;
  }
  const double power = static_cast<double>(light->power(c.bounds).r);
  EXPECT_NEAR(mean.mean() / power, 1.0, 4.5 * mean.error() / power + c.powerOff);
  // Of a soft spot about as wide as the sphere it is farther off.
  const double factor = std::string(c.label).starts_with("softSpot") ? 3.0 : 1.1;
  const double rough = static_cast<double>(light->roughPower(c.bounds).r) / power;
  EXPECT_GT(rough, 1 / factor);
  EXPECT_LT(rough, factor);
}

const BoundingSphere unit{{0, 0, 0}, 1};
const BoundingSphere aside{{1, -2, 0.5}, 2.5};
const Disc across{{0.1, 0, -0.2}, glm::normalize(Vec3d(0.3, 1, 0.2)), 0.5};
const Disc asideDisc{{1.5, -1.5, 0}, glm::normalize(Vec3d(1, -1, 0.4)), 1.0};

// What lines through the sphere tell of a vast surface.
constexpr double kByLines = 5e-3;

const Case cases[] = {
    {"pointOutside", "point", {{"position", "[0, 3, 1]"}}, unit, across},
    {"pointNearTheSurface", "point", {{"position", "[0.3, 0.96, 0.1]"}}, unit, across},
    {"pointInside", "point", {{"position", "[0.2, 0.5, 0]"}}, unit, across},
    {"pointFar", "point", {{"position", "[6e5, 7e5, -4e5]"}}, unit, across},
    {"pointAside", "point", {{"position", "[7, -6, 1]"}, {"intensity", "8"}}, aside, asideDisc},
    {"rectOutside",
     "rect",
     {{"position", "[0.3, 3, 1]"}, {"size", "[2, 0.7]"}, {"intensity", "2"}},
     unit,
     across},
    {"rectLarge", "rect", {{"position", "[0, 2, 0.5]"}, {"size", "[9, 5]"}}, unit, across},
    {"rectEdgeOn",
     "rect",
     {{"position", "[0, 3, 1]"}, {"target", "[4, 3.2, 1]"}, {"size", "[1, 2]"}},
     unit,
     across},
    {"rectInside",
     "rect",
     {{"position", "[0, 0.7, 0]"}, {"target", "[0, 0, 0.2]"}, {"size", "[0.3, 0.2]"}},
     unit,
     across},
    {"rectFar", "rect", {{"position", "[6e5, 7e5, -4e5]"}, {"size", "[1e5, 1e5]"}}, unit, across},
    {"diskOutside", "disk", {{"position", "[1, -3, 1]"}, {"radius", "1.5"}}, unit, across},
    {"diskAside",
     "disk",
     {{"position", "[7, -6, 1]"}, {"target", "[1, -1, 0]"}, {"radius", "2"}},
     aside,
     asideDisc},
    {"sphereOutside", "sphere", {{"position", "[0, 3, 1]"}, {"radius", "1"}}, unit, across},
    {"sphereInside", "sphere", {{"position", "[0.3, 0.6, 0]"}, {"radius", "0.1"}}, unit, across},
    {"sphereFar", "sphere", {{"position", "[6e5, 7e5, -4e5]"}, {"radius", "1e5"}}, unit, across},
    {"rectVast",
     "rect",
     {{"position", "[0, 2, 0.5]"}, {"size", "[1e9, 1e9]"}},
     unit,
     across,
     kByLines},
    {"rectVastBesideIt",
     "rect",
     {{"position", "[60, 1.5, 0]"}, {"target", "[60, 0, 0]"}, {"size", "[120, 1e4]"}},
     unit,
     across,
     kByLines},
    {"rectStripe",
     "rect",
     {{"position", "[0, 2, 0]"}, {"size", "[1e3, 1.5]"}},
     unit,
     across,
     kByLines},
    {"rectLongAndThin", "rect", {{"position", "[0, 2, 0]"}, {"size", "[1e6, 0.1]"}}, unit, across},
    {"rectLongAndThinAside",
     "rect",
     {{"position", "[3e5, 1.5, 2]"}, {"target", "[3e5, 0, 0]"}, {"size", "[6e5, 0.1]"}},
     unit,
     across},
    {"rectCutsTheSphere",
     "rect",
     {{"position", "[0, 0.3, 0]"}, {"target", "[0.1, -1, 0]"}, {"size", "[40, 60]"}},
     unit,
     across,
     kByLines},
    {"diskVast", "disk", {{"position", "[0, 2, 0]"}, {"radius", "1e6"}}, unit, across, kByLines},
    {"diskVastAtItsRim",
     "disk",
     {{"position", "[100.2, 1.6, 0]"}, {"target", "[100.2, 0, 0]"}, {"radius", "100"}},
     unit,
     across,
     kByLines},
    {"sphereVast",
     "sphere",
     {{"position", "[0, 1e9, 0]"}, {"radius", "999999998"}},
     unit,
     across,
     kByLines},
    {"sphereLarge",
     "sphere",
     {{"position", "[0, 152, 0]"}, {"radius", "150"}},
     unit,
     across,
     kByLines},
    {"sphereLargeCutsTheSphere",
     "sphere",
     {{"position", "[0, 20.4, 0]"}, {"radius", "20"}},
     unit,
     across,
     kByLines},
    {"softPointLarge",
     "point",
     {{"position", "[0, 52, 0]"}, {"radius", "50"}, {"intensity", "1e3"}},
     unit,
     across,
     kByLines},
    {"softSpotVast",
     "spot",
     {{"position", "[0, 52, 0]"}, {"cone_angle", "60"}, {"radius", "50"}, {"intensity", "1e3"}},
     unit,
     across},
    {"softPointOutside", "point", {{"position", "[0, 3, 1]"}, {"radius", "0.8"}}, unit, across},
    {"softPointInside", "point", {{"position", "[0.3, 0.6, 0]"}, {"radius", "0.1"}}, unit, across},
    {"softSpotOutside",
     "spot",
     {{"position", "[0, 4, 0]"}, {"cone_angle", "60"}, {"radius", "0.5"}},
     unit,
     across},
    {"softSpotCutsTheSphere",
     "spot",
     {{"position", "[0, 3, 0]"},
      {"target", "[0.9, 0, 0]"},
      {"cone_angle", "16"},
      {"cone_edge", "5"},
      {"radius", "0.3"}},
     unit,
     across},
    {"softSpotLarge",
     "spot",
     {{"position", "[2, 7, 0]"}, {"cone_angle", "25"}, {"cone_edge", "20"}, {"radius", "3"}},
     unit,
     across},
    {"softSpotInside",
     "spot",
     {{"position", "[0.1, 0.7, 0]"}, {"cone_angle", "40"}, {"radius", "0.1"}},
     unit,
     across},
    {"softSpotAcrossTheSurface",
     "spot",
     {{"position", "[0.2, 0.85, 0]"},
      {"target", "[-0.6, 0.9, 0]"},
      {"cone_angle", "80"},
      {"cone_edge", "20"},
      {"radius", "0.4"}},
     unit,
     across},
    {"softSpotFar",
     "spot",
     {{"position", "[6e5, 7e5, -4e5]"}, {"cone_angle", "0.02"}, {"radius", "100"}},
     unit,
     across},
    {"softSpotAside",
     "spot",
     {{"position", "[6, -7, 3]"},
      {"target", "[2, -1, 0]"},
      {"cone_angle", "20"},
      {"cone_edge", "20"},
      {"radius", "0.4"}},
     aside,
     asideDisc},
    {"spotCoversAll", "spot", {{"position", "[0, 4, 0]"}, {"cone_angle", "60"}}, unit, across},
    {"spotInside", "spot", {{"position", "[0.1, 0.7, 0]"}, {"cone_angle", "40"}}, unit, across},
    {"spotInsideSoft",
     "spot",
     {{"position", "[0.1, 0.7, 0]"}, {"cone_angle", "70"}, {"cone_edge", "60"}},
     unit,
     across},
    {"spotCutsTheSphere",
     "spot",
     {{"position", "[0, 3, 0]"},
      {"target", "[0.9, 0, 0]"},
      {"cone_angle", "16"},
      {"cone_edge", "5"}},
     unit,
     across},
    {"spotWide",
     "spot",
     {{"position", "[0, 0.4, 0]"}, {"target", "[0, 2, 0]"}, {"cone_angle", "179.9"}},
     unit,
     across},
    {"spotWideSoft",
     "spot",
     {{"position", "[0, 3, 0]"},
      {"target", "[0, 9, 0]"},
      {"cone_angle", "179.9"},
      {"cone_edge", "40"}},
     unit,
     across},
    {"spotNarrow",
     "spot",
     {{"position", "[0, 3, 1]"}, {"cone_angle", "0.01"}, {"cone_edge", "0.004"}},
     unit,
     {{0, 0, 0}, glm::normalize(Vec3d(0, 3, 1)), 0.0004}},
    {"spotFar",
     "spot",
     {{"position", "[6e5, 7e5, -4e5]"}, {"cone_angle", "0.01"}, {"cone_edge", "0.01"}},
     unit,
     across},
    {"spotFarInItsEdge",
     "spot",
     {{"position", "[0, 1e6, 0]"},
      {"target", "[100, 0, 0]"},
      {"cone_angle", "0.01"},
      {"cone_edge", "0.008"}},
     unit,
     across},
    {"spotAside",
     "spot",
     {{"position", "[6, -7, 3]"},
      {"target", "[2, -1, 0]"},
      {"cone_angle", "20"},
      {"cone_edge", "20"}},
     aside,
     asideDisc},
    {"directional", "directional", {{"position", "[1, 5, 2]"}, {"intensity", "3"}}, unit, across},
    {"directionalAside",
     "directional",
     {{"position", "[-1e6, 1e6, 3e5]"}, {"target", "[2, 2, 2]"}},
     aside,
     asideDisc},
    {"environment", "environment", {{"intensity", "0.5"}}, unit, across},
    {"environmentAside", "environment", {}, aside, asideDisc},
};

INSTANTIATE_TEST_SUITE_P(Lights, Flux, ::testing::ValuesIn(cases),
                         [](const auto& test) { return std::string(test.param.label); });

// Furnace: uniform surroundings of radiance L send pi L A through any disc.
TEST(Environment, SendsPiTimesRadianceThroughEveryDisc) {
  const auto light = makeLight("environment", {{"color", "[0.5, 1, 2]"}});
  const BoundingSphere bounds{{3, 0, -1}, 2};
  for (const Disc& disc : {Disc{{3, 0, -1}, {0, 0, 1}, 1.0}, Disc{{3.7, 0.9, -2}, {1, 0, 0}, 0.5},
                           Disc{{3, -1.2, -1}, glm::normalize(Vec3d(1, 1, -1)), 0.7}}) {
    Rng rng(RandomKey::fromSeed(7, 0), RandomStream::test, 0);
    Mean mean;
    for (int i = 0; i < 500000; ++i) {
      const Emission photon = light->emit(bounds, uniform4(rng));
      // Both faces of the disc are lit.
      mean.add(crosses(photon, disc) ? static_cast<double>(photon.power.b) / 2 : 0.0);
    }
    const double expected = 2 * kPi * kPi * disc.radius * disc.radius;
    EXPECT_NEAR(mean.mean(), expected, 4.5 * mean.error());
    EXPECT_LT(mean.error() / expected, 0.01);
  }
  EXPECT_EQ(light->background({0, 1, 0}), Rgb(0.5f, 1, 2));
}

}  // namespace
}  // namespace photosphere::lights
