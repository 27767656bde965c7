// Cameras over the shutter against cameras of the time itself, and blur against closed forms.
#include "photosphere/cameras/moving_camera.h"

#include <fmt/format.h>

#include <cmath>

#include "photosphere/core/registry.h"
#include "photosphere/core/rng.h"
#include "support/support.h"

namespace photosphere::cameras {
namespace {

constexpr int kPixels = 400;

std::unique_ptr<Camera> makeCamera(std::string_view type, const Mat4d& place,
                                   std::string_view option = {}, double value = 0) {
  const CameraPlugin& plugin = findPlugin(cameraModels(), type, "camera", "test");
  ParamValues values(plugin.params);
  if (!option.empty()) values.setText(option, fmt::format("{}", value), "test");
  return plugin.create(values, place, {kPixels, kPixels / 2});
}

Mat4d turnedAbout(const Vec3d& axis, double angle, const Vec3d& eye) {
  const double c = std::cos(angle), s = std::sin(angle);
  Mat4d m(1.0);
  for (int i = 0; i < 3; ++i) {
    Vec3d e(0.0);
    e[i] = 1;
    m[i] = glm::dvec4(e * c + glm::cross(axis, e) * s + axis * (glm::dot(axis, e) * (1 - c)), 0);
  }
  m[3] = glm::dvec4(eye, 1);
  return m;
}

Box3d cube(const Vec3d& center, double half) {
  Box3d box;
  box.grow(center - half);
  box.grow(center + half);
  return box;
}

// The largest error of rays at random times and places, in pixels at the smoke.
double worstError(const MovingCamera& moving, const MovingCamera::At& at, double open, double close,
                  double distance) {
  Rng rng(RandomKey::fromSeed(4, 0), RandomStream::test, 0);
  double worst = 0;
  for (int i = 0; i < 3000; ++i) {
    const double u = rng.uniformDouble();
    const Vec2d raster(kPixels * rng.uniformDouble(), kPixels / 2 * rng.uniformDouble());
    const auto exact = at(open + u * (close - open));
    const CameraRay a = exact->ray(raster), b = moving.ray(raster, u);
    const CameraRay beside = exact->ray(raster + Vec2d(0, 1));
    const Vec3d p = a.origin + a.direction * distance;
    const double pixel = glm::length(beside.origin + beside.direction * distance - p);
    worst = std::max(worst, glm::length(b.origin + b.direction * distance - p) / pixel);
    EXPECT_NEAR(glm::length(b.direction), 1.0, 1e-12);
  }
  return worst;
}

TEST(MovingCamera, FollowsTheCameraOfTheTime) {
  const Box3d smoke = cube({0, 0, 0}, 1);
  struct Case {
    const char* label;
    MovingCamera::At at;
    std::vector<double> keys;
  };
  const Case cases[] = {
      {"orbit that looks at the smoke",
       [](double t) {
         return makeCamera("perspective", lookAt({8 * t, 2 * t, 5}, {0, 0.3, 0}, {0, 1, 0}));
       },
       {}},
      {"break at a key",
       [](double t) {
         return makeCamera("perspective",
                           lookAt({3 * std::abs(t - 0.1), 1, 5}, {0, 0, 0}, {0, 1, 0}));
       },
       {-3.0, 0.1, 7.0}},
      {"whip pan",
       [](double t) {
         return makeCamera("perspective",
                           turnedAbout(glm::normalize(Vec3d(1, 4, 2)), 3 * t, {0, 0, 5}));
       },
       {}},
      {"zoom",
       [](double t) {
         return makeCamera("perspective", lookAt({0, 0, 5}, {0, 0, 0}, {0, 1, 0}), "fov",
                           30 + 40 * t);
       },
       {}},
      {"parallel rays",
       [](double t) {
         return makeCamera("orthographic", turnedAbout({0, 1, 0}, t, {t, 0, 5}), "width", 4 + t);
       },
       {}},
      {"panorama",
       [](double t) {
         return makeCamera("equirectangular", turnedAbout({1, 0, 0}, t, {t, 0, 5}));
       },
       {}},
  };
  for (const Case& c : cases) {
    const MovingCamera moving(c.at, -0.5, 0.5, c.keys, smoke);
    EXPECT_LT(worstError(moving, c.at, -0.5, 0.5, 5), 1.5 * MovingCamera::kTolerance) << c.label;
    EXPECT_LT(moving.moments(), 200u) << c.label;
    for (const double u : {0.0, 0.3, 1.0}) {
      const Placement exact = placementOf(*c.at(u - 0.5)), place = moving.placement(u);
      EXPECT_LT(glm::length(place.eye - exact.eye), 2e-3) << c.label;
      EXPECT_LT(glm::length(place.axis - exact.axis), 2e-3) << c.label;
      EXPECT_LT(glm::length(place.up - exact.up), 2e-3) << c.label;
    }
  }
}

// Straight flight needs no more cameras than its ends, and is exact.
TEST(MovingCamera, IsExactAlongAStraightLine) {
  const auto at = [](double t) {
    return makeCamera("perspective", turnedAbout({0, 1, 0}, 0.2, {3 * t, t, 5}));
  };
  const MovingCamera moving(at, 10, 12, {}, cube({30, 10, 0}, 1));
  EXPECT_EQ(moving.moments(), 2u);
  EXPECT_LT(worstError(moving, at, 10, 12, 5), 1e-9);
}

// A point at depth d moves over width / (2 d tan(fov / 2)) pixels for each unit of sideways flight.
TEST(MovingCamera, BlursByTheClosedForm) {
  const double scale = kPixels / (2 * std::tan(kPi / 12));
  const Box3d smoke = cube({0, 0, 0}, 0.5);
  const auto flight = [&](double way) {
    return MovingCamera(
        [&](double t) {
          return makeCamera("perspective", lookAt({way * t, 0, 5}, {way * t, 0, 0}, {0, 1, 0}));
        },
        0, 1, {}, smoke);
  };
  for (const double way : {0.01, 0.2})
    EXPECT_NEAR(flight(way).blur(smoke), scale * way / 4.5, 1e-6 * scale) << "at its nearest face";
  EXPECT_NEAR(flight(0.0).blur(smoke), 0, 1e-9);
  EXPECT_EQ(flight(0.2).blur(Box3d()), 0);
  // There and back: the ends are one, the way is not nothing.
  const std::vector<double> keys{0.5};
  const MovingCamera back(
      [&](double t) {
        const double x = 0.2 * (1 - std::abs(2 * t - 1));
        return makeCamera("perspective", lookAt({x, 0, 5}, {x, 0, 0}, {0, 1, 0}));
      },
      0, 1, keys, smoke);
  EXPECT_NEAR(back.blur(smoke), scale * 0.2 / 4.5, 1e-6 * scale);
  // A panorama that turns by a tenth, also across its seam: a tenth of its width.
  for (const double start : {0.0, kPi}) {
    const MovingCamera around(
        [&](double t) {
          return makeCamera("equirectangular",
                            turnedAbout({0, 1, 0}, start + 0.2 * kPi * (t - 0.5), {0, 0, 5}));
        },
        0, 1, {}, smoke);
    EXPECT_NEAR(around.blur(smoke), 0.1 * kPixels, 0.01 * kPixels) << start;
  }
  // A camera that leaves the smoke behind it blurs it over the frame.
  const MovingCamera through(
      [&](double t) {
        return makeCamera("perspective", turnedAbout({0, 1, 0}, 0, {0, 0, 2 - 4 * t}));
      },
      0, 1, {}, smoke);
  EXPECT_NEAR(through.blur(smoke), kPixels * std::sqrt(1.25), 1e-9);
}

TEST(MovingCamera, KnowsItsParallax) {
  const Box3d smoke = cube({0, 0, 0}, 1e-6);
  const auto at = [](double t) {
    return makeCamera("perspective", lookAt({2 * t, 0, 5}, {0, 0, 0}, {0, 1, 0}));
  };
  EXPECT_NEAR(MovingCamera(at, -0.5, 0.5, {}, smoke).parallax(smoke), std::atan(1.0 / 5), 1e-5);
  const auto pan = [](double t) {
    return makeCamera("perspective", turnedAbout({0, 1, 0}, t, {0, 0, 5}));
  };
  EXPECT_NEAR(MovingCamera(pan, -0.5, 0.5, {}, smoke).parallax(smoke), 0, 1e-9);
  const auto turn = [](double t) {
    return makeCamera("orthographic", turnedAbout({0, 1, 0}, t, {0, 0, 5}));
  };
  EXPECT_NEAR(MovingCamera(turn, -0.5, 0.5, {}, smoke).parallax(smoke), 0.5, 1e-3);
}

}  // namespace
}  // namespace photosphere::cameras
