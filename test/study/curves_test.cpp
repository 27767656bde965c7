// Curves whose crossings and fronts can be worked out by hand.

#include "curves.h"

#include <gtest/gtest.h>

#include <cmath>

namespace photosphere::study {
namespace {

PointResult point(const std::string& family, double seconds, double error) {
  PointResult p;
  p.family = family;
  p.label = family + " " + std::to_string(seconds);
  p.seconds.total = {seconds, 0.9 * seconds, 1.1 * seconds};
  const Estimate e{error * error, 0.81 * error * error, 1.21 * error * error};
  for (auto& layer : p.errors)
    for (ErrorFigures& f : layer)
      f.relMse = e;
  return p;
}

// error = 0.1 / sqrt(t), and a flat 0.05 that is quick: they meet at t = 4.
SweepResult twoFamilies() {
  SweepResult sweep;
  for (const double t : {1.0, 4.0, 16.0, 64.0})
    sweep.points.push_back(point("path_traced", t, 0.1 / std::sqrt(t)));
  for (const double t : {0.5, 2.0, 8.0})
    sweep.points.push_back(point("view", t, 0.05));
  return sweep;
}

TEST(Curves, interpolateStraightInLogarithms) {
  const auto curves = curvesOf(twoFamilies(), kTotal, kAllPixels);
  ASSERT_EQ(curves.size(), 2u);
  const Curve& path = curves[0];
  EXPECT_EQ(path.title, "path tracing");
  EXPECT_NEAR(*errorAt(path, 9), 0.1 / 3, 1e-9);
  EXPECT_NEAR(*errorAt(path, 1000), 0.1 / 8, 1e-9);
  EXPECT_FALSE(errorAt(path, 0.99).has_value());
  EXPECT_NEAR(*secondsFor(path, 0.1 / 3), 9, 1e-6);
  EXPECT_NEAR(*secondsFor(path, 0.2), 1, 1e-9);
  EXPECT_FALSE(secondsFor(path, 0.01).has_value());
}

TEST(Curves, crossWhereTheyMeet) {
  const auto found = crossovers(curvesOf(twoFamilies(), kMultiple, kSmokeOnly));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].before, "photosphere, view");
  EXPECT_EQ(found[0].after, "path tracing");
  EXPECT_NEAR(found[0].seconds, 4, 1e-6);
  EXPECT_NEAR(found[0].error, 0.05, 1e-9);
}

TEST(Curves, theFrontIsWhatNothingDominates) {
  const auto curves = curvesOf(twoFamilies(), kTotal, kAllPixels);
  const auto front = [](const Curve& curve) {
    std::string marks;
    for (const CurvePoint& p : curve.points)
      marks += p.onFront ? '1' : '0';
    return marks;
  };
  EXPECT_EQ(front(curves[0]), "0011");  // at t = 1 and 4 the view is faster and no worse
  EXPECT_EQ(front(curves[1]), "100");
}

TEST(Curves, leaveSingleScatteringOutOfWhatItDoesNotEstimate) {
  SweepResult sweep = twoFamilies();
  sweep.points.push_back(point("single", 0.1, 0.9));
  EXPECT_EQ(curvesOf(sweep, kTotal, kAllPixels).size(), 3u);
  EXPECT_EQ(curvesOf(sweep, kMultiple, kAllPixels).size(), 2u);
}

TEST(Curves, anErrorBelowZeroTakesItsUpperEnd) {
  SweepResult sweep;
  sweep.points.push_back(point("view", 1, 0.1));
  sweep.points.back().errors[kTotal][kAllPixels].relMse = {-1e-4, -3e-4, 1e-4};
  const auto curves = curvesOf(sweep, kTotal, kAllPixels);
  EXPECT_NEAR(curves[0].points[0].error, 0.01, 1e-12);
  EXPECT_GT(curves[0].points[0].low, 0);
}

TEST(RoundNumbers, lieWithinWhatWasMeasured) {
  const auto curves = curvesOf(twoFamilies(), kTotal, kAllPixels);
  EXPECT_EQ(roundTimes(curves), (std::vector<double>{0.5, 1, 2, 5, 10, 20, 50}));
  EXPECT_EQ(roundErrors(curves), (std::vector<double>{0.1, 0.05, 0.02}));
}

}  // namespace
}  // namespace photosphere::study
