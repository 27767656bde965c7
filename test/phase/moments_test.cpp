// Legendre moments against integrals over the sphere.

#include <cmath>

#include "photosphere/phase/phase.h"
#include "support/support.h"

namespace photosphere::phase {
namespace {

// Integral of the phase function times P_l over the sphere, in panels that are finer near the ends,
// where lobes are.
std::vector<double> integrated(const PhaseFunction& phase, std::size_t count) {
  std::vector<double> sums(count, 0.0);
  constexpr int panels = 40000;
  for (int i = 0; i < panels; ++i) {
    // Angles at even steps of u, as t = pi (3 u^2 - 2 u^3).
    const double u = (i + 0.5) / panels;
    const double t = kPi * u * u * (3 - 2 * u), dt = kPi * 6 * u * (1 - u) / panels;
    const Vec3f wo(Vec3d(std::sin(t), 0, std::cos(t)));
    const double part =
        2 * kPi * std::sin(t) * dt * static_cast<double>(phase.evaluate({0, 0, 1}, wo));
    double previous = 1, current = std::cos(t);
    for (std::size_t l = 0; l < count; ++l) {
      sums[l] += part * previous;
      const auto n = static_cast<double>(l + 1);
      const double next = ((2 * n + 1) * std::cos(t) * current - n * previous) / (n + 1);
      previous = current;
      current = next;
    }
  }
  return sums;
}

struct MomentsCase {
  const char* name;
  PhaseFunction phase;
};
void PrintTo(const MomentsCase& c, std::ostream* out) {
  *out << c.name;
}

class Moments : public ::testing::TestWithParam<MomentsCase> {};

TEST_P(Moments, AreIntegralsOverTheSphere) {
  const PhaseFunction& phase = GetParam().phase;
  const std::vector<double> moments = legendreMoments(phase);
  EXPECT_EQ(moments[0], 1.0);
  const std::vector<double> expected =
      integrated(phase, std::min<std::size_t>(moments.size() + 4, 60));
  for (std::size_t l = 0; l < expected.size(); ++l)
    EXPECT_NEAR(l < moments.size() ? moments[l] : 0.0, expected[l], 2e-5) << l;
  EXPECT_NEAR(moments.size() > 1 ? moments[1] : 0.0, phase.meanCosine(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(
    Phases, Moments,
    ::testing::Values(MomentsCase{"Isotropic", HenyeyGreenstein(0.0)},
                      MomentsCase{"Forward", HenyeyGreenstein(0.7)},
                      MomentsCase{"Backward", HenyeyGreenstein(-0.95)},
                      MomentsCase{"Needle", HenyeyGreenstein(0.99)},
                      MomentsCase{"Rayleigh", Draine(0.0, 1.0)},
                      MomentsCase{"Draine", Draine(0.6, 1.0)},
                      MomentsCase{"DraineBackward", Draine(-0.9, 30.0)},
                      // Every other moment is nothing, which does not end them.
                      MomentsCase{"OppositeLobes", PhaseFunction(Draine(0.97), Draine(-0.97), 0.5)},
                      MomentsCase{"Fog", PhaseFunction(Draine(0.96), Draine(0.5, 40.0), 0.3)}));

TEST(Moments, GoOnUntilTheyAreNothing) {
  const PhaseFunction opposite(Draine(0.97), Draine(-0.97), 0.5);
  EXPECT_GT(legendreMoments(opposite).size(), 500u);
  EXPECT_EQ(legendreMoments(HenyeyGreenstein(0.0)).size(), 1u);
  EXPECT_EQ(legendreMoments(Draine(0.0, 1.0)).size(), 3u);
  // A needle beyond what any table resolves is widened, not cut: no ringing.
  const std::vector<double> needle = legendreMoments(HenyeyGreenstein(0.99999));
  EXPECT_LT(needle.back(), 1e-3);
  for (std::size_t l = 1; l < needle.size(); ++l)
    ASSERT_LE(needle[l], needle[l - 1]);
}

}  // namespace
}  // namespace photosphere::phase
