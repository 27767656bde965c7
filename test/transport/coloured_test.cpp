// Extinction that differs from channel to channel: weights, furnaces, transmittances.

#include <gtest/gtest.h>

#include <mutex>

#include "photosphere/render/integrator.h"
#include "photosphere/render/shadows.h"
#include "photosphere/transport/scatter.h"
#include "photosphere/transport/tracking.h"
#include "support/estimate.h"
#include "support/media.h"
#include "support/support.h"

namespace photosphere::test {
namespace {

using transport::Flight;
using transport::Medium;
using transport::MediumVolume;

const Rgb kTint(0.1f, 0.4f, 1.0f);

MediumVolume tinted(const Rgb& tint, double extinction, const Rgb& albedo = Rgb(0.9f)) {
  MediumVolume v = sampledVolume(1.0, 32, {.g = 0.4, .extinction = extinction}, plumeDensity);
  v.tint = tint;
  v.albedo = albedo;
  return v;
}

// The sum of a photon's channels never grows, whatever it passes.
class LargestSum final : public transport::FlightSink {
 public:
  void consume(std::span<const Flight> flights) override {
    const std::lock_guard lock(m_mutex);
    for (const Flight& flight : flights) {
      const float sum = flight.power.x + flight.power.y + flight.power.z;
      largest = std::max(largest, sum);
      scatterings = std::max(scatterings, flight.scatterings);
      m_coloured = m_coloured || flight.power.x > 2.0f * flight.power.z;
    }
  }
  bool coloured() const { return m_coloured; }
  float largest = 0.0f;
  std::uint32_t scatterings = 0;

 private:
  std::mutex m_mutex;
  bool m_coloured = false;
};

TEST(ColouredExtinction, PhotonWeightsStayBounded) {
  const Medium medium = makeMedium(tinted(kTint, 60.0, Rgb(0.99f, 0.9f, 0.999f)));
  EXPECT_TRUE(medium.isColoured());
  EXPECT_FALSE(medium.isGrey());
  transport::LightList lights;
  lights.push_back(makeLight("directional", {{"position", "[-1, 0, 0]"}, {"target", "[0, 0, 0]"}}));
  LargestSum sink;
  transport::TraceOptions options;
  options.photons = kSanitized ? 2'000 : 50'000;
  options.key = RandomKey::fromSeed(4, 0);
  const transport::TraceStatistics stats = transport::tracePhotons(medium, lights, options, sink);
  const double born = (stats.emitted.x + stats.emitted.y + stats.emitted.z);
  // But for the roulette of channels that are next to dark.
  EXPECT_LE(static_cast<double>(sink.largest), born * 1.02);
  EXPECT_GT(sink.scatterings, 20u);
  EXPECT_TRUE(sink.coloured()) << "red passes where blue is held back";
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(stats.imbalance()[c], 0.0, 1e-9 * born);
  EXPECT_EQ(stats.majorantViolations, 0u);
}

// A ray through the unit box.
const Vec3f kBeside(-0.5f, 0.01f, 0.02f), kAcross(1, 0, 0);

// Tracked through the unit box, whose extinction is even, each channel has the transmittance of its
// own.
void expectBeers(const Medium& medium, double densest, const Rgb& tint, int count,
                 transport::TrackingCounters& counters) {
  Vec3d sum(0.0);
  for (int i = 0; i < count; ++i) {
    Rng rng(RandomKey::fromSeed(2, 0), RandomStream::camera, static_cast<std::uint64_t>(i));
    sum += Vec3d(transport::trackTransmittance<Rgb>(medium, kBeside, kAcross, 1.0f, rng, counters));
  }
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(sum[c] / count, std::exp(-densest * static_cast<double>(tint[c])),
                4 * 0.5 / std::sqrt(count))
        << "channel " << c;
}

TEST(ColouredExtinction, TransmittanceIsBeersOfEachChannel) {
  MediumVolume box = boxVolume(Vec3d(1.0), Vec3i(8), {.extinction = 3.0});
  box.tint = kTint;
  const Medium medium = makeMedium(std::move(box));
  ASSERT_TRUE(medium.tint());
  const Rgb depth = transport::marchOpticalDepth<Rgb>(medium, kBeside, kAcross, 1.0f, 0.1f);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(depth[c], 3.0f * kTint[c], 1e-4f);
  const int count = kSanitized ? 2'000 : 40'000;
  transport::TrackingCounters counters;
  expectBeers(medium, 3.0, kTint, count, counters);
}

// Two volumes of different colours have no common one: tables hold three channels.
TEST(ColouredExtinction, ShadowTablesOfMixedColoursAgreeWithMarching) {
  std::vector<MediumVolume> volumes;
  volumes.push_back(tinted(kTint, 20.0));
  MediumVolume other =
      sampledVolume(1.0, 32, {.extinction = 5.0}, [](const Vec3d& p) { return plumeDensity(-p); });
  other.tint = Rgb(1.0f, 0.5f, 0.2f);
  volumes.push_back(std::move(other));
  const Medium medium(std::move(volumes));
  EXPECT_TRUE(medium.isColoured());
  EXPECT_EQ(medium.tint(), nullptr);
  const transport::LightList lights = lampsBesideAndWithin();
  const auto step = static_cast<float>(medium.voxelEdge());
  const render::Shadows table(medium, lights, render::ShadowMode::grid, step, 0);
  const render::Shadows march(medium, lights, render::ShadowMode::march, step / 2, 0);
  Rng rng(RandomKey::fromSeed(9, 0), RandomStream::camera, 0);
  transport::TrackingCounters counters;
  double worst = 0, red = 0, blue = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3f p = 0.8f * (Vec3f(rng.uniform(), rng.uniform(), rng.uniform()) - 0.5f);
    if (!(medium.extinction(p) > 0.0f)) continue;
    for (std::size_t light = 0; light < 2; ++light) {
      const lights::Illumination in = lights[light]->illuminate(p, Vec2f(0.5f));
      const Rgb a = table.transmittance<Rgb>(light, p, in.direction, in.distance, rng, counters);
      const Rgb b = march.transmittance<Rgb>(light, p, in.direction, in.distance, rng, counters);
      worst = std::max(worst, static_cast<double>(maxComponent(glm::abs(a - b))));
      red += static_cast<double>(a.x);
      blue += static_cast<double>(a.z);
    }
  }
  EXPECT_LT(worst, 0.12);
  EXPECT_GT(red, 1.05 * blue) << "the channels differ";
}

// In surroundings of 1, smoke of albedo 1 is seen as nothing, in every channel.
TEST(ColouredExtinction, WhiteFurnaceIsOneInEveryChannel) {
  const Medium medium = makeMedium(tinted(kTint, 40.0, Rgb(1.0f)));
  transport::LightList lights;
  lights.push_back(makeLight("environment", {}));
  for (const render::EnvironmentSampling sampling :
       {render::EnvironmentSampling::escape, render::EnvironmentSampling::nextEvent}) {
    render::PathOptions options;
    options.environment = sampling;
    const auto path = render::makePathIntegrator(medium, lights, options);
    for (int c = 0; c < 3; ++c) {
      const Estimate e =
          estimate(*path, Vec3d(0.02, -3, 0.1), Vec3f(0, 1, 0), 20'000,
                   [c](const render::RayRadiance& r) { return static_cast<double>(r.total()[c]); });
      EXPECT_NEAR(e.mean, 1.0, 4 * e.error + 1e-3) << "channel " << c;
      EXPECT_LT(e.error, 0.05);
    }
  }
}

// Each channel is what grey smoke of its own extinction is.
void expectChannelsOfGreySmoke(const Rgb& tint, double densest, const Rgb& albedo,
                               std::size_t ofLight, std::size_t ofTransmittance) {
  transport::LightList lights;
  lights.push_back(
      makeLight("directional", {{"position", "[-1, -0.3, 0.4]"}, {"target", "[0, 0, 0]"}}));
  const Medium coloured = makeMedium(tinted(tint, densest, albedo));
  const auto path = render::makePathIntegrator(coloured, lights, {});
  for (int c = 0; c < 3; ++c) {
    const Medium grey =
        makeMedium(tinted(Rgb(1.0f), densest * static_cast<double>(tint[c]), Rgb(albedo[c])));
    const auto alone = render::makePathIntegrator(grey, lights, {});
    const auto light = [c](const render::RayRadiance& r) {
      return static_cast<double>(r.total()[c]);
    };
    const auto through = [c](const render::RayRadiance& r) {
      return static_cast<double>(r.transmittance[c]);
    };
    const Vec3d eye(0.03, -3, 0.05);
    const Estimate a = estimate(*path, eye, Vec3f(0, 1, 0), ofLight, light);
    const Estimate b = estimate(*alone, eye, Vec3f(0, 1, 0), ofLight, light);
    EXPECT_NEAR(a.mean, b.mean, 4 * std::hypot(a.error, b.error)) << "channel " << c;
    EXPECT_GT(b.mean, 0.0);
    const Estimate t = estimate(*path, eye, Vec3f(0, 1, 0), ofTransmittance, through);
    const Estimate u = estimate(*alone, eye, Vec3f(0, 1, 0), ofTransmittance, through);
    EXPECT_NEAR(t.mean, u.mean, 4 * std::hypot(t.error, u.error)) << "channel " << c;
  }
}

TEST(ColouredExtinction, ChannelsAreThoseOfGreySmoke) {
  expectChannelsOfGreySmoke(kTint, 30.0, Rgb(0.95f, 0.8f, 0.99f), 80'000, 20'000);
}

// Smoke that is a hundred thousand times as dense to blue as to red.
const Rgb kSteepTint(8e-6f, 3e-3f, 1.0f);
constexpr double kDensest = 5e5;

// Once blue has ended, nothing keeps red at its pace.
TEST(ColouredExtinction, TransmittanceTakesNoStepsForChannelsThatHaveEnded) {
  MediumVolume box = boxVolume(Vec3d(1.0), Vec3i(8), {.extinction = kDensest});
  box.tint = kSteepTint;
  const Medium medium = makeMedium(std::move(box));
  const int count = kSanitized ? 1'000 : 20'000;
  transport::TrackingCounters counters;
  expectBeers(medium, kDensest, kSteepTint, count, counters);
  EXPECT_LT(counters.lookups, 5000u * static_cast<unsigned>(count)) << "500,000 at blue's pace";
  EXPECT_EQ(counters.majorantViolations, 0u);
}

TEST(ColouredExtinction, SteepChannelsAreThoseOfGreySmoke) {
  expectChannelsOfGreySmoke(kSteepTint, kDensest, Rgb(0.9f, 0.95f, 0.99f), 4096, 4096);
}

// Light in all of the smoke, by the length of flights and by their collisions [W m].
class Fluence final : public transport::FlightSink {
 public:
  explicit Fluence(std::uint64_t photons) : m_photons(photons) {}
  void consume(std::span<const Flight> flights) override {
    const std::lock_guard lock(m_mutex);
    for (const Flight& flight : flights) {
      byLength += Vec3d(flight.power) * static_cast<double>(flight.length) / m_photons;
      if (!flight.collided()) continue;
      collisions += Vec3d(flight.collisionPower()) / m_photons;
      byCollisions += Vec3d(flight.collisionPower()) /
                      (static_cast<double>(flight.extinctionAtEnd) * m_photons);
    }
  }
  Vec3d byLength{0.0}, byCollisions{0.0}, collisions{0.0};

 private:
  double m_photons;
  std::mutex m_mutex;
};

TEST(ColouredExtinction, PhotonsOfSteepChannelsAreThoseOfGreySmoke) {
  const Rgb albedo(0.9f, 0.7f, 0.3f), tint(8e-4f, 0.03f, 1.0f);
  constexpr double kExtinction = 3e4;
  transport::LightList lights;
  lights.push_back(makeLight("directional", {{"position", "[-1, 0, 0]"}, {"target", "[0, 0, 0]"}}));
  const auto trace = [&](const Medium& medium, transport::TraceStatistics& stats) {
    transport::TraceOptions options;
    options.photons = kSanitized ? 1'000 : 40'000;
    options.key = RandomKey::fromSeed(6, 0);
    auto sink = std::make_unique<Fluence>(options.photons);
    stats = transport::tracePhotons(medium, lights, options, *sink);
    return sink;
  };
  transport::TraceStatistics all, one;
  // Filled to its faces: fluence in empty space would hide what the smoke holds.
  const auto box = [](const Rgb& t, double extinction, const Rgb& a) {
    MediumVolume v = boxVolume(Vec3d(1.0), Vec3i(8), {.g = 0.4, .extinction = extinction});
    v.tint = t;
    v.albedo = a;
    return makeMedium(std::move(v));
  };
  const auto coloured = trace(box(tint, kExtinction, albedo), all);
  EXPECT_EQ(all.majorantViolations, 0u);
  EXPECT_LT(all.flights, 400 * all.photons) << "tens of thousands at blue's pace";
  for (int c = 0; c < 3; ++c) {
    const double own = kExtinction * static_cast<double>(tint[c]);
    const auto grey = trace(box(Rgb(1.0f), own, Rgb(albedo[c])), one);
    const double bound = (kSanitized ? 0.3 : 0.04) * grey->byLength[c];
    EXPECT_NEAR(coloured->byLength[c], grey->byLength[c], bound) << "channel " << c;
    EXPECT_NEAR(coloured->byCollisions[c], grey->byCollisions[c], bound) << "channel " << c;
    EXPECT_NEAR(all.escaped[c], one.escaped[c], 0.02 * one.emitted[c]) << "channel " << c;
    // As if each collision were one of the densest channel's.
    EXPECT_NEAR(coloured->collisions[c], grey->byLength[c] * kExtinction, bound * kExtinction);
  }
}

}  // namespace
}  // namespace photosphere::test
