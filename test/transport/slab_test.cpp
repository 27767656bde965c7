// Photon tracing against the adding-doubling and discrete-ordinates values of slab.csv.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <ostream>

#include "photosphere/core/sampling.h"
#include "photosphere/transport/photon_tracer.h"
#include "support/media.h"
#include "support/slab_table.h"
#include "support/support.h"

namespace photosphere::test {

namespace {

using transport::Flight;

// Injects photons of unit power at the middle of the upper face.
class InjectionLight final : public lights::Light {
 public:
  InjectionLight(double top, bool diffuse) : m_top(top), m_diffuse(diffuse) {}
  Rgb power(const lights::BoundingSphere&) const override { return Rgb(1.0f); }
  lights::Emission emit(const lights::BoundingSphere&, const Vec4f& u) const override {
    const Vec3f w = m_diffuse ? sampleCosineHemisphere({u.x, u.y}) : Vec3f(0, 0, 1);
    // Starts just above the middle of the face.
    return {Vec3d(0, 0, m_top) + Vec3d(w) * 1e-6, -w, Rgb(1.0f)};
  }
  lights::Illumination illuminate(const Vec3f&, const Vec2f&) const override { return {}; }
  bool isDelta() const override { return true; }
  bool isGrey() const override { return true; }

 private:
  double m_top;
  bool m_diffuse;
};

// Counts photons by how they left.
struct LeaveCounter final : transport::FlightSink {
  void consume(std::span<const Flight> flights) override {
    std::uint64_t up = 0, down = 0, straight = 0;
    for (const Flight& flight : flights) {
      if (flight.collided()) continue;
      if (flight.direction.z > 0)
        ++up;
      else
        ++(flight.scatterings ? down : straight);
    }
    reflected += up;
    scatteredThrough += down;
    unscattered += straight;
  }
  std::atomic<std::uint64_t> reflected{0}, scatteredThrough{0}, unscattered{0};
};

// Four standard errors of a binomial count; the Poisson bound, wide enough for the same tail, where
// few are expected.
double allowed(double expected, double n) {
  const double p = expected / n;
  return expected < 50 ? 4 * std::sqrt(expected) + 6 : 4 * std::sqrt(expected * (1 - p));
}

struct SlabCase {
  std::string illumination;
  double tau, albedo, g;
};
void PrintTo(const SlabCase& c, std::ostream* out) {
  *out << c.illumination << " tau " << c.tau << " albedo " << c.albedo << " g " << c.g;
}

class Slab : public testing::TestWithParam<SlabCase> {};

TEST_P(Slab, ReflectanceAndTransmittance) {
  const SlabCase& c = GetParam();
  const transport::Medium medium = slabMedium(c.tau, c.albedo, c.g);
  transport::LightList lights;
  lights.push_back(std::make_unique<InjectionLight>(c.tau / 2, c.illumination == "diffuse"));
  LeaveCounter sink;
  transport::TraceOptions options;
  // Through the deepest a photon scatters a thousand times.
  options.photons = kSanitized ? 20'000 : c.tau > 16 ? 150'000 : 500'000;
  options.key = RandomKey::fromSeed(7, 0);
  const transport::TraceStatistics stats = tracePhotons(medium, lights, options, sink);
  EXPECT_EQ(stats.majorantViolations, 0u);
  EXPECT_NEAR(maxComponent(stats.imbalance()), 0.0, 1e-9);
  const double n = static_cast<double>(options.photons);
  auto check = [&](const char* quantity, double counted) {
    const double expected = slabValue(c.illumination, c.tau, c.albedo, c.g, quantity) * n;
    EXPECT_NEAR(counted, expected, allowed(expected, n)) << quantity;
  };
  check("R", static_cast<double>(sink.reflected));
  check("T_scattered", static_cast<double>(sink.scatteredThrough));
  check("T_unscattered", static_cast<double>(sink.unscattered));
}

// Coloured smoke weighs its photons, so power leaves them at every event and must be found again.
TEST(PhotonTracer, ColouredPowersAddUp) {
  transport::MediumVolume volume = boxVolume(Vec3d(1.0), Vec3i(8), {1.0, 0.5, 6.0});
  volume.albedo = Rgb(0.95f, 0.6f, 0.2f);
  const transport::Medium medium = makeMedium(std::move(volume));
  transport::LightList lights;
  lights.push_back(makeLight("point", {{"position", "[3, 1, 2]"}, {"color", "[1, 2, 3]"}}));
  LeaveCounter sink;
  transport::TraceOptions options;
  options.photons = 20'000;
  const transport::TraceStatistics stats = tracePhotons(medium, lights, options, sink);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(stats.imbalance()[c], 0.0, 1e-9 * stats.emitted[c]);
    EXPECT_GT(stats.missed[c], 0.0);
    EXPECT_GT(stats.absorbed[c], 0.0);
    EXPECT_GT(stats.escaped[c], 0.0);
  }
  // The darker the channel, the more of its power stays.
  EXPECT_GT(stats.absorbed.z / stats.emitted.z, 2 * stats.absorbed.x / stats.emitted.x);
}

// Most of these photons leave after more than kLongPath scatterings: those that are not ended then
// carry the power of those that are.
TEST(PhotonTracer, LongPathsKeepTheirPower) {
  const transport::Medium medium = slabMedium(700, 1.0, 0.0);
  transport::LightList lights;
  lights.push_back(std::make_unique<InjectionLight>(0.0, false));
  LeaveCounter sink;
  transport::TraceOptions options;
  options.photons = kSanitized ? 8 : 160;
  options.key = RandomKey::fromSeed(5, 0);
  const transport::TraceStatistics stats = tracePhotons(medium, lights, options, sink);
  EXPECT_GT(stats.capped, 0u);
  EXPECT_NEAR(stats.imbalance().x, 0.0, 1e-9);
  // Spread of one photon's power about 1; without the twofold power 0.6 would be left.
  EXPECT_NEAR(stats.escaped.x, 1.0, 4.0 / std::sqrt(static_cast<double>(options.photons)));
}

std::vector<SlabCase> cases() {
  std::vector<SlabCase> all;
  for (const SlabRow& row : slabTable())
    if (row.quantity == "R") all.push_back({row.illumination, row.tau, row.albedo, row.g});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Reference, Slab, testing::ValuesIn(cases()), [](const auto& slab) {
  std::string name = slab.param.illumination + "_tau" + std::to_string(slab.param.tau) + "_albedo" +
                     std::to_string(slab.param.albedo) + "_g" + std::to_string(slab.param.g);
  for (char& ch : name)
    if (!std::isalnum(static_cast<unsigned char>(ch))) ch = '_';
  return name;
});

}  // namespace

}  // namespace photosphere::test
