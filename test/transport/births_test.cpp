// Which source a photon is born of.
#include "births.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/media.h"

namespace photosphere::test {
namespace {

using transport::SourceChoice;

// The least number in [0, 1) for which a later source than `i` is chosen.
double endOf(const SourceChoice& choice, std::size_t i) {
  double low = 0.0, high = 1.0;
  for (int step = 0; step < 200; ++step) {
    const double middle = 0.5 * (low + high);
    (choice.choose(middle) > i ? high : low) = middle;
  }
  return high;
}

// A weak lamp beside a sun, before it or after: births of its photons are as likely as their weight
// says, however weak it is.
TEST(SourceChoice, WeakLampsAreChosenAsOftenAsTheyWeigh) {
  const transport::Medium medium =
      makeMedium(sampledVolume(1.0, 8, {}, [](const Vec3d&) { return 1.0; }));
  for (const double weak : {1e-3, 1e-8, 1e-11})
    for (const bool first : {true, false}) {
      transport::LightList lights;
      const auto add = [&](double megawatt) {
        lights.push_back(makeLight(
            "point", {{"position", "[2, 0, 0]"}, {"intensity", std::to_string(megawatt * 1e6)}}));
      };
      add(first ? weak : 1.0);
      add(first ? 1.0 : weak);
      const SourceChoice choice(medium, lights);
      const std::size_t which = first ? 0 : 1;
      ASSERT_NEAR(choice.probability(which) / weak, 1.0, 0.01);
      const double chosen = first ? endOf(choice, 0) : 1.0 - endOf(choice, 0);
      EXPECT_NEAR(chosen / choice.probability(which), 1.0, 1e-4) << weak;
      // The last number that a sequence has finds the last source.
      EXPECT_EQ(choice.choose(1.0 - 0x1p-53), 1u);
      EXPECT_EQ(choice.choose(0.0), 0u);
    }
}

// A sequence's fine numbers go on where its floats end.
TEST(BirthSequence, FineNumbersAreFinerFloats) {
  const transport::BirthSequence sequence(RandomKey::fromSeed(3, 0));
  int differ = 0;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const auto coarse = static_cast<double>(sequence(i, 0));
    EXPECT_GE(sequence.fine(i, 0), coarse);
    EXPECT_LT(sequence.fine(i, 0), coarse + 0x1p-24);
    differ += sequence.fine(i, 0) > coarse;
  }
  EXPECT_GT(differ, 990);
}

}  // namespace
}  // namespace photosphere::test
