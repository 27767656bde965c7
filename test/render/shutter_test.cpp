// Samples over the shutter: a moving camera smears what stands still.

#include <gtest/gtest.h>

#include <cmath>

#include "photosphere/core/registry.h"
#include "photosphere/render/frame.h"
#include "support/frames.h"

namespace photosphere::test {
namespace {

constexpr int kPixels = 64;
constexpr double kFov = 40;
constexpr double kDistance = 10;

// A small bright ball: radiance where a ray passes within its size.
class Ball final : public render::Integrator {
 public:
  explicit Ball(const Vec3d& at) : m_at(at) {}
  render::RayRadiance radiance(const Vec3d& origin, const Vec3f& direction, transport::Moment, Rng&,
                               render::IntegratorCounters&) const override {
    const Vec3d d = glm::normalize(Vec3d(direction)), to = m_at - origin;
    render::RayRadiance r;
    if (glm::length(to - d * glm::dot(to, d)) < 0.1) r.single = Rgb(1.0f);
    r.depth = static_cast<float>(glm::dot(to, d));
    r.opacity = 1;
    r.transmittance = Rgb(0.0f);
    return r;
  }

 private:
  Vec3d m_at;
};

// At (x, 0, 0), looking along -Z.
std::unique_ptr<cameras::Camera> cameraAt(double x, double z = 0) {
  const cameras::CameraPlugin& plugin =
      findPlugin(cameras::cameraModels(), "perspective", "camera", "test");
  ParamValues values(plugin.params);
  values.setText("fov", fmt::format("{}", kFov), "test");
  Mat4d place(1.0);
  place[3] = glm::dvec4(x, 0, z, 1);
  return plugin.create(values, place, {kPixels, kPixels});
}

Box3d ballBox() {
  Box3d box;
  box.grow(Vec3d(-0.1, -0.1, -kDistance - 0.1));
  box.grow(Vec3d(0.1, 0.1, -kDistance + 0.1));
  return box;
}

render::FrameOptions options(int samples) {
  render::FrameOptions o;
  o.samples = samples;
  o.filter = render::FilterKind::box;
  o.crop = {Vec2i(0), Vec2i(kPixels)};
  o.key = RandomKey::fromSeed(3, 0);
  return o;
}

struct Smear {
  double x = 0, y = 0, varianceX = 0, varianceY = 0, sum = 0;
  int first = kPixels, last = -1;  // columns with light
};

Smear smearOf(const render::FrameLayers& frame) {
  Smear s;
  double xx = 0, yy = 0;
  for (int y = 0; y < kPixels; ++y)
    for (int x = 0; x < kPixels; ++x) {
      const auto v = static_cast<double>(frame.single[static_cast<std::size_t>(y * kPixels + x)].r);
      if (!(v > 0)) continue;
      s.first = std::min(s.first, x);
      s.last = std::max(s.last, x);
      s.sum += v;
      s.x += v * (x + 0.5);
      s.y += v * (y + 0.5);
      xx += v * (x + 0.5) * (x + 0.5);
      yy += v * (y + 0.5) * (y + 0.5);
    }
  s.x /= s.sum;
  s.y /= s.sum;
  s.varianceX = xx / s.sum - s.x * s.x;
  s.varianceY = yy / s.sum - s.y * s.y;
  return s;
}

// A flight of w across the view moves the ball evenly over L = w * scale / distance pixels: its
// mean is that of the middle, its variance grows by L^2 / 12, across the flight by nothing.
TEST(Shutter, SmearsByTheClosedForm) {
  const double scale = kPixels / (2 * std::tan(kFov * kPi / 360));
  const auto still = cameraAt(0);
  const Smear sharp = smearOf(renderFrame(*still, Ball({0, 0, -kDistance}), options(256)));
  for (const double way : {0.8, 3.0}) {
    const cameras::MovingCamera motion([&](double t) { return cameraAt(way * t); }, -0.5, 0.5, {},
                                       ballBox());
    render::FrameOptions o = options(256);
    o.moving = true;
    o.motion = &motion;
    const Smear smear = smearOf(renderFrame(*still, Ball({0, 0, -kDistance}), o));
    const double length = way * scale / kDistance;
    EXPECT_NEAR(smear.varianceX - sharp.varianceX, length * length / 12,
                0.02 * length * length / 12);
    EXPECT_NEAR(smear.varianceY, sharp.varianceY, 0.02);
    EXPECT_NEAR(smear.x, sharp.x, 0.02 * length);
    EXPECT_NEAR(smear.sum, sharp.sum, 0.02 * sharp.sum) << "light is spread, not lost";
    EXPECT_NEAR(smear.last - smear.first, sharp.last - sharp.first + length, 1.5);
  }
}

// The times of a pixel's samples lie evenly, whichever pass they belong to.
TEST(Shutter, FewSamplesCoverItEvenly) {
  const auto still = cameraAt(0);
  const cameras::MovingCamera motion([](double t) { return cameraAt(6 * t); }, -0.5, 0.5, {},
                                     ballBox());
  render::FrameOptions o = options(16);
  o.moving = true;
  o.motion = &motion;
  const Smear whole = smearOf(renderFrame(*still, Ball({0, 0, -kDistance}), o));
  o.samples = 8;
  o.firstSample = 8;
  const Smear later = smearOf(renderFrame(*still, Ball({0, 0, -kDistance}), o));
  const double length = 6 * kPixels / (2 * std::tan(kFov * kPi / 360)) / kDistance;
  EXPECT_NEAR(whole.varianceX, length * length / 12, 0.08 * length * length / 12);
  EXPECT_NEAR(later.varianceX, length * length / 12, 0.12 * length * length / 12);
}

// Nothing moves: the same bits as ever. A camera that has a shutter and stands still: the same too.
TEST(Shutter, AStillCameraKeepsItsBits) {
  const auto still = cameraAt(0.1);
  const Ball ball({0, 0, -kDistance});
  const render::FrameLayers plain = renderFrame(*still, ball, options(4));
  const cameras::MovingCamera motion([](double) { return cameraAt(0.1); }, -0.5, 0.5, {},
                                     ballBox());
  render::FrameOptions o = options(4);
  o.moving = true;
  EXPECT_EQ(renderFrame(*still, ball, o).beauty, plain.beauty);
  o.motion = &motion;
  EXPECT_EQ(renderFrame(*still, ball, o).beauty, plain.beauty);
}

// Depth is along the axis of the camera of the time: a flight toward the ball gives the mean.
TEST(Shutter, DepthAndFocusFollowTheCamera) {
  const auto still = cameraAt(0);
  const cameras::MovingCamera motion([](double t) { return cameraAt(0, -2 * t); }, -0.5, 0.5, {},
                                     ballBox());
  render::FrameOptions o = options(64);
  o.moving = true;
  o.motion = &motion;
  const render::FrameLayers frame = renderFrame(*still, Ball({0, 0, -kDistance}), o);
  const std::size_t middle = kPixels / 2 * kPixels + kPixels / 2;
  EXPECT_NEAR(static_cast<double>(frame.depth[middle]), kDistance, 0.05);
  // In focus a lens changes nothing but noise, although the camera turns under way.
  const auto turned = [](double t) {
    const cameras::CameraPlugin& plugin =
        findPlugin(cameras::cameraModels(), "perspective", "camera", "test");
    ParamValues values(plugin.params);
    values.setText("fov", fmt::format("{}", kFov), "test");
    return plugin.create(values,
                         cameras::lookAt({20 * t, 0, -kDistance + 10 * std::sqrt(1 - 4 * t * t)},
                                         {0, 0, -kDistance}, {0, 1, 0}),
                         {kPixels, kPixels});
  };
  const cameras::MovingCamera orbit(turned, -0.3, 0.3, {}, ballBox());
  o.motion = &orbit;
  const Smear pinhole = smearOf(renderFrame(*still, Ball({0, 0, -kDistance}), o));
  o.lens = {0.5, kDistance};
  const Smear lens = smearOf(renderFrame(*still, Ball({0, 0, -kDistance}), o));
  EXPECT_NEAR(lens.varianceX, pinhole.varianceX, 0.05);
  EXPECT_NEAR(pinhole.varianceX, pinhole.varianceY, 0.05) << "it looks at the ball all the time";
}

}  // namespace
}  // namespace photosphere::test
