// Depth of field against the geometry of a thin lens.

#include <gtest/gtest.h>

#include <cmath>

#include "photosphere/render/frame.h"
#include "support/frames.h"

namespace photosphere::test {
namespace {

// Something small at a place: radiance where a ray passes within its size.
class Speck final : public render::Integrator {
 public:
  Speck(const Vec3d& at, double size) : m_at(at), m_size(size) {}
  render::RayRadiance radiance(const Vec3d& origin, const Vec3f& direction, transport::Moment, Rng&,
                               render::IntegratorCounters&) const override {
    const Vec3d d = glm::normalize(Vec3d(direction)), to = m_at - origin;
    render::RayRadiance r;
    if (glm::length(to - d * glm::dot(to, d)) < m_size) r.single = Rgb(1.0f);
    return r;
  }

 private:
  Vec3d m_at;
  double m_size;
};

struct Spot {
  double x = 0, y = 0, spread = 0, sum = 0;  // mean and variance along an axis [pixels]
};

Spot spotOf(const render::FrameLayers& frame) {
  Spot spot;
  double squares = 0;
  for (int y = 0; y < frame.height(); ++y)
    for (int x = 0; x < frame.width(); ++x) {
      const auto value =
          static_cast<double>(frame.single[static_cast<std::size_t>(y * frame.width() + x)].r);
      spot.sum += value;
      spot.x += value * (x + 0.5);
      spot.y += value * (y + 0.5);
      squares += value * ((x + 0.5) * (x + 0.5) + (y + 0.5) * (y + 0.5));
    }
  spot.x /= spot.sum;
  spot.y /= spot.sum;
  spot.spread = 0.5 * (squares / spot.sum - spot.x * spot.x - spot.y * spot.y);
  return spot;
}

constexpr int kPixels = 80;
constexpr double kFov = 40;

Spot render(double distance, double aside, const render::Lens& lens, int samples) {
  const auto camera = perspectiveCamera({0, -10, 0}, kFov, kPixels);
  render::FrameOptions options;
  options.samples = samples;
  options.filter = render::FilterKind::box;
  options.crop = {Vec2i(0), Vec2i(kPixels)};
  options.key = RandomKey::fromSeed(3, 0);
  options.lens = lens;
  return spotOf(render::renderFrame(*camera, Speck({aside, distance - 10, 0}, 0.05), options));
}

// A point out of focus becomes a disc of diameter 2 R |1/d - 1/f| times the picture's scale; the
// variance of a disc of radius r along an axis is r^2 / 4.
TEST(Lens, BlursByTheCircleOfConfusion) {
  const double scale = kPixels / (2 * std::tan(kFov * kPi / 360));
  for (const double distance : {5.0, 8.0, 20.0}) {
    const render::Lens lens{0.5, 8.0};
    const double radius = lens.radius * scale * std::abs(1 / distance - 1 / lens.focusDistance);
    const Spot pinhole = render(distance, 0.0, {}, 256), blurred = render(distance, 0.0, lens, 256);
    EXPECT_NEAR(std::sqrt(std::max(0.0, 4 * (blurred.spread - pinhole.spread))), radius,
                0.05 * radius + 0.15)
        << distance;
    EXPECT_NEAR(blurred.x, pinhole.x, 0.25);
    EXPECT_NEAR(blurred.y, pinhole.y, 0.25);
    EXPECT_NEAR(blurred.sum / pinhole.sum, 1, 0.06) << "light is spread, not lost";
  }
}

// The plane in focus is flat: also beside the axis.
TEST(Lens, IsSharpOverThePlaneInFocus) {
  for (const double aside : {0.0, 2.0}) {
    const Spot pinhole = render(8, aside, {}, 256), sharp = render(8, aside, {0.5, 8.0}, 256);
    EXPECT_NEAR(sharp.spread, pinhole.spread, 0.05) << aside;
    EXPECT_NEAR(sharp.x, pinhole.x, 0.05) << aside;
  }
}

}  // namespace
}  // namespace photosphere::test
