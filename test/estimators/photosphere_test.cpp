// The photosphere against path tracing, the furnace, and itself.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>

#include "photosphere/core/error.h"
#include "photosphere/core/parallel.h"
#include "photosphere/estimators/light_cache.h"
#include "support/frames.h"
#include "support/scenes.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using estimators::Basis;
using estimators::Carrier;
using estimators::Deposit;
using estimators::LightFieldLayout;

constexpr int kPixels = 64;
constexpr std::uint64_t kManyPhotons = kSanitized ? 5'000 : 1'000'000;

// Seed of the photons; another from PHOTOSPHERE_TEST_SEED, to calibrate bounds over many.
std::uint64_t photonSeed() {
  const char* text = std::getenv("PHOTOSPHERE_TEST_SEED");
  return text ? std::strtoull(text, nullptr, 10) : 5;
}

struct Judged {
  TestScene scene;
  Truth truth;
};

const Judged& judged(const std::string& name) {
  static std::map<std::string, Judged> cache;
  const auto found = cache.find(name);
  if (found != cache.end()) return found->second;
  Judged j;
  if (name == "sphere") j.scene = sphereScene(8, 0.95, 0.5, 32, kPixels);
  if (name == "plume") j.scene = plumeScene(0.7, 96, kPixels);
  if (name == "column") j.scene = columnScene(kPixels);
  j.scene.particles = seedParticles(*j.scene.medium, 60000);
  j.truth = pathTruth(j.scene, kSanitized ? 2 : 1024);
  return cache.emplace(name, std::move(j)).first->second;
}

struct AgreementCase {
  std::string scene;
  Carrier carrier;
  Basis basis;
};

const char* nameOf(Basis basis) {
  return basis == Basis::view ? "view" : basis == Basis::histogram ? "histogram" : "harmonics";
}

// What GoogleTest prints of a case.
std::ostream& operator<<(std::ostream& out, const AgreementCase& c) {
  return out << c.scene << (c.carrier == Carrier::voxels ? " voxels" : " particles") << ' '
             << nameOf(c.basis);
}

class Agreement : public testing::TestWithParam<AgreementCase> {};

TEST_P(Agreement, WithPathTracing) {
  const AgreementCase& c = GetParam();
  const Judged& j = judged(c.scene);
  LightFieldLayout layout;
  layout.carrier = c.carrier;
  layout.basis = c.basis;
  layout.order = 8;
  layout.channels = 1;
  const PhotosphereFrame frame = renderPhotosphere(j.scene, layout, kManyPhotons, photonSeed());
  const LayerError total = j.truth.errorOf(frame.layers, &render::FrameLayers::beauty);
  const LayerError multiple = j.truth.errorOf(frame.layers, &render::FrameLayers::multiple);
  std::printf(
      "  total: mean ratio %.4f, relMSE %.5f (smoke %.5f); multiple: %.4f, %.5f (smoke %.5f); "
      "reference noise %.5f\n",
      total.meanRatio, total.relMse, total.relMseSmoke, multiple.meanRatio, multiple.relMse,
      multiple.relMseSmoke, multiple.referenceNoise);
  EXPECT_EQ(frame.layers.nanSamples + frame.layers.negativeSamples, 0u);
  if (kSanitized) return;  // too few paths to judge by
  // Over the seeds 1 to 4, 6 and 7, 2026-11-22 (PHOTOSPHERE_TEST_SEED): voxels within 0.0074 in the
  // mean, relMSE at most 0.0032 (multiple 0.0082); particles within 0.0249, 0.0034 (0.0104). The
  // errors' bounds are twice that.
  const bool voxels = c.carrier == Carrier::voxels;
  EXPECT_NEAR(total.meanRatio, 1.0, voxels ? 0.01 : 0.03);
  EXPECT_LT(total.relMse, 0.007);
  EXPECT_LT(multiple.relMse, voxels ? 0.017 : 0.021);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, Agreement,
    testing::Values(AgreementCase{"sphere", Carrier::voxels, Basis::view},
                    AgreementCase{"sphere", Carrier::voxels, Basis::histogram},
                    AgreementCase{"sphere", Carrier::voxels, Basis::sphericalHarmonics},
                    AgreementCase{"sphere", Carrier::particles, Basis::view},
                    AgreementCase{"sphere", Carrier::particles, Basis::histogram},
                    AgreementCase{"plume", Carrier::voxels, Basis::view},
                    AgreementCase{"plume", Carrier::voxels, Basis::histogram},
                    AgreementCase{"plume", Carrier::voxels, Basis::sphericalHarmonics},
                    AgreementCase{"plume", Carrier::particles, Basis::view},
                    AgreementCase{"plume", Carrier::particles, Basis::histogram},
                    AgreementCase{"column", Carrier::voxels, Basis::view},
                    AgreementCase{"column", Carrier::voxels, Basis::histogram},
                    AgreementCase{"column", Carrier::particles, Basis::view},
                    AgreementCase{"column", Carrier::particles, Basis::histogram}),
    [](const auto& row) {
      return row.param.scene + (row.param.carrier == Carrier::voxels ? "_voxels" : "_particles") +
             '_' + nameOf(row.param.basis);
    });

// Albedo 1 in surroundings of radiance 1: every pixel is 1.
class Furnace : public testing::TestWithParam<AgreementCase> {};

TEST_P(Furnace, IsOneEverywhere) {
  TestScene scene;
  scene.medium = std::make_unique<transport::Medium>(
      makeMedium(sampledVolume(1.0, 48, {1.0, 0.6, 15.0}, plumeDensity)));
  scene.lights.push_back(makeLight("environment", {}));
  scene.camera = perspectiveCamera({0, -3, 0.4}, 22, kPixels);
  scene.particles = seedParticles(*scene.medium, 60000);
  LightFieldLayout layout;
  layout.carrier = GetParam().carrier;
  layout.basis = GetParam().basis;
  layout.channels = 1;
  layout.unscattered = true;
  const PhotosphereFrame frame = renderPhotosphere(scene, layout, kManyPhotons, photonSeed());
  const BlockDeviation off = deviationFromOne(frame.layers.beauty, kPixels, 8);
  std::printf("  mean %.5f, worst block off by %.4f\n", off.mean, off.worst);
  if (kSanitized) return;
  EXPECT_NEAR(off.mean, 1.0, 0.005);
  EXPECT_LT(off.worst, 0.03);
}

INSTANTIATE_TEST_SUITE_P(Carriers, Furnace,
                         testing::Values(AgreementCase{"", Carrier::voxels, Basis::view},
                                         AgreementCase{"", Carrier::voxels, Basis::histogram},
                                         AgreementCase{"", Carrier::particles, Basis::histogram}),
                         [](const auto& row) {
                           return std::string(row.param.carrier == Carrier::voxels ? "voxels"
                                                                                   : "particles") +
                                  (row.param.basis == Basis::view ? "_view" : "_histogram");
                         });

// Every legal layout that reaches the same answer by another way.
TEST(LightField, CollisionDepositAgreesInTheMean) {
  const RunOnly runOnly;
  const TestScene scene = sphereScene(6, 0.9, 0.3, 32, kPixels);
  const render::FrameLayers truth = renderPath(scene, 256, 1);
  LightFieldLayout layout;
  layout.channels = 1;
  layout.deposit = Deposit::collision;
  const PhotosphereFrame frame = renderPhotosphere(scene, layout, 500'000, 5);
  double image = 0, reference = 0;
  for (std::size_t i = 0; i < truth.multiple.size(); ++i) {
    image += static_cast<double>(frame.layers.multiple[i].y);
    reference += static_cast<double>(truth.multiple[i].y);
  }
  EXPECT_NEAR(image / reference, 1.0, 0.015);
}

// The paper's energy rules blur the source itself and so are off at the smoke's edge (METHOD.md
// section 5 finds about 10 % for the paper's settings); the error must shrink with the radius.
double powerRatio(const TestScene& scene, estimators::EnergyRule rule, double radius,
                  double reference) {
  LightFieldLayout layout;
  layout.channels = 1;
  layout.carrier = Carrier::particles;
  layout.basis = Basis::histogram;
  layout.deposit = Deposit::collision;
  layout.energy = rule;
  layout.radius = radius;
  const PhotosphereFrame frame = renderPhotosphere(scene, layout, 100'000, 5);
  double image = 0;
  for (const Rgb& c : frame.layers.multiple)
    image += static_cast<double>(c.y);
  std::printf("  rule %d, radius %.3f: ratio %.4f\n", static_cast<int>(rule), radius,
              image / reference);
  return image / reference;
}

TEST(LightField, PowerOnParticlesConvergesWithItsRadius) {
  const RunOnly runOnly;
  TestScene scene = sphereScene(6, 0.9, 0.3, 32, kPixels);
  scene.particles = seedParticles(*scene.medium, 60000);
  const render::FrameLayers truth = renderPath(scene, 256, 1);
  double reference = 0;
  for (const Rgb& c : truth.multiple)
    reference += static_cast<double>(c.y);
  const double wide = powerRatio(scene, estimators::EnergyRule::gather, 0.06, reference);
  const double narrow = powerRatio(scene, estimators::EnergyRule::gather, 0.03, reference);
  EXPECT_NEAR(wide, 1.0, 0.2);
  EXPECT_NEAR(narrow, 1.0, 0.12);
  EXPECT_LT(std::abs(narrow - 1), std::abs(wide - 1));
  EXPECT_NEAR(powerRatio(scene, estimators::EnergyRule::scatter, 0.06, reference), 1.0, 0.05);
}

bool sameBits(const std::vector<Rgb>& a, const std::vector<Rgb>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Rgb)) == 0;
}

TEST(LightField, ThreadsDoNotChangeOneBit) {
  TestScene scene = sphereScene(8, 0.95, 0.5, 24, 32);
  scene.particles = seedParticles(*scene.medium, 5000);
  for (const Carrier carrier : {Carrier::voxels, Carrier::particles})
    for (const Deposit deposit : {Deposit::trackLength, Deposit::collision}) {
      LightFieldLayout layout;
      layout.channels = 1;
      layout.carrier = carrier;
      layout.deposit = deposit;
      std::vector<Rgb> first;
      for (const unsigned threads : {1u, 2u, 7u}) {
        const ThreadLimit limit(threads);
        const PhotosphereFrame frame = renderPhotosphere(scene, layout, 30'000, 5);
        if (threads == 1) first = frame.layers.beauty;
        EXPECT_TRUE(sameBits(first, frame.layers.beauty)) << threads << " threads";
      }
    }
}

TEST(LightField, SeedsChangeTheNoise) {
  const TestScene scene = sphereScene(8, 0.95, 0.5, 24, 32);
  LightFieldLayout layout;
  layout.channels = 1;
  EXPECT_FALSE(sameBits(renderPhotosphere(scene, layout, 10'000, 5).layers.multiple,
                        renderPhotosphere(scene, layout, 10'000, 6).layers.multiple));
}

TEST(LightCache, HoldsTheSameNumbers) {
  TestScene scene = sphereScene(8, 0.95, 0.5, 24, 32);
  scene.particles = seedParticles(*scene.medium, 3000);
  const TemporaryFolder folder;
  for (const Carrier carrier : {Carrier::voxels, Carrier::particles})
    for (const bool unscattered : {false, true}) {
      LightFieldLayout layout;
      layout.carrier = carrier;
      layout.basis = Basis::histogram;
      layout.unscattered = unscattered;
      layout.radius = 0.1;
      transport::TraceOptions options;
      options.photons = 5000;
      transport::TraceStatistics statistics;
      const auto field = estimators::traceLightField(
          *scene.medium, scene.lights, layout, scene.view(), scene.particles, options, statistics);
      const estimators::LightCacheKey key{"m", "l", {Vec3d(1e6, -3, 0.5), 0.01}};
      const auto path = folder / "light.vdb";
      writeLightCache(path, field, key);
      const auto back = readLightCache(path, key, false);
      EXPECT_EQ(back.values, field.values);
      EXPECT_EQ(back.carriers(), field.carriers());
      EXPECT_EQ(back.photons, field.photons);
      EXPECT_EQ(back.layout.radius, field.layout.radius);
      if (carrier == Carrier::voxels) {
        EXPECT_EQ(back.lattice.origin(), field.lattice.origin());
        for (std::size_t i = 0; i < field.carriers(); ++i)
          ASSERT_EQ(back.lattice.voxel(i), field.lattice.voxel(i));
      } else {
        EXPECT_EQ(back.particles, field.particles);
      }
    }
}

TEST(LightCache, RefusesWhatIsStaleOrForeign) {
  const TestScene scene = sphereScene(8, 0.95, 0.5, 16, 16);
  const TemporaryFolder folder;
  LightFieldLayout layout;
  layout.basis = Basis::histogram;
  transport::TraceOptions options;
  options.photons = 100;
  transport::TraceStatistics statistics;
  auto field = estimators::traceLightField(*scene.medium, scene.lights, layout, scene.view(), {},
                                           options, statistics);
  const auto path = folder / "light.vdb";
  writeLightCache(path, field, {"m", "l", {}});
  EXPECT_THROW(estimators::readLightCache(path, {"other", "l", {}}, false), InputError);
  EXPECT_THROW(estimators::readLightCache(path, {"m", "other", {}}, false), InputError);
  EXPECT_NO_THROW(estimators::readLightCache(path, {"other", "other", {}}, true));
  EXPECT_THROW(
      estimators::readLightCache(projectFile("data/caches/column_0020.vdb"), {"m", "l", {}}, false),
      InputError);
  field.layout.basis = Basis::view;
  EXPECT_THROW(writeLightCache(path, field, {"m", "l", {}}), ConfigError);
}

}  // namespace

}  // namespace photosphere::test
