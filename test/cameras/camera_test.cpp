// Rays against matrices, placement, and options.
#include "photosphere/cameras/camera.h"

#include <fmt/format.h>

#include <cmath>

#include "photosphere/core/error.h"
#include "photosphere/core/registry.h"
#include "photosphere/core/rng.h"
#include "photosphere/core/sampling.h"
#include "support/support.h"

namespace photosphere::cameras {
namespace {

using Options = std::vector<std::pair<std::string, std::string>>;

std::unique_ptr<Camera> makeCamera(std::string_view type, const Options& options,
                                   const Mat4d& place, const Vec2i& resolution = {1280, 720}) {
  const CameraPlugin& plugin = findPlugin(cameraModels(), type, "camera", "test");
  ParamValues values(plugin.params);
  for (const auto& [name, value] : options)
    values.setText(name, value, "test");
  return plugin.create(values, place, resolution);
}

double rigidError(const Mat4d& m) {
  const Mat3d r(m), product = glm::transpose(r) * r;
  double error = std::abs(glm::determinant(r) - 1);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      error = std::max(error, std::abs(product[i][j] - (i == j ? 1 : 0)));
  return error;
}

Vec2d project(const Camera& camera, const Vec3d& p) {
  const glm::dvec4 h = camera.ndcFromWorld().value() * glm::dvec4(p, 1);
  return Vec2d(h) / h.w;
}

// A point on the ray of a raster position comes back to raster / resolution.
TEST(Projection, InvertsTheRaysOfRandomCameras) {
  Rng rng(RandomKey::fromSeed(1, 0), RandomStream::test, 0);
  auto between = [&](double a, double b) { return a + (b - a) * rng.uniformDouble(); };
  for (int trial = 0; trial < 300; ++trial) {
    const Vec3d eye(between(-9, 9), between(-9, 9), between(-9, 9));
    const Vec3d target(between(-9, 9), between(-9, 9), between(-9, 9));
    const Mat4d place = lookAt(eye, target, Vec3d(sampleSphere(rng.uniform2())));
    const Vec2i resolution(1 + static_cast<int>(between(0, 3000)),
                           1 + static_cast<int>(between(0, 3000)));
    const std::string near = fmt::format("{}", trial % 2 ? between(0, 2) : 0.0);
    for (const auto& camera :
         {makeCamera("perspective", {{"fov", fmt::format("{}", between(1, 150))}, {"near", near}},
                     place, resolution),
          makeCamera("orthographic",
                     {{"width", fmt::format("{}", between(0.1, 50))}, {"near", near}}, place,
                     resolution)}) {
      for (int i = 0; i < 20; ++i) {
        const Vec2d raster(between(-0.1, 1.1) * resolution.x, between(-0.1, 1.1) * resolution.y);
        const CameraRay ray = camera->ray(raster);
        ASSERT_NEAR(glm::length(ray.direction), 1.0, 1e-14);
        const Vec3d p = ray.origin + ray.direction * between(0.5, 30);
        const Vec2d ndc = project(*camera, p);
        ASSERT_NEAR(ndc.x, raster.x / resolution.x, 1e-9);
        ASSERT_NEAR(ndc.y, raster.y / resolution.y, 1e-9);
        // worldToCamera: left-handed, +Z forward.
        const Vec3d c = transformPoint(camera->cameraFromWorld(), p);
        ASSERT_NEAR(c.z, glm::dot(p - eye, glm::normalize(target - eye)), 1e-9);
        ASSERT_GE(c.z, std::stod(near));
        ASSERT_LT(glm::determinant(Mat3d(camera->cameraFromWorld())), 0.0);
      }
    }
  }
}

// Of all cameras, panoramas too; gradients against differences along the picture.
TEST(Projection, OfPointsInvertsRaysAndKnowsItsGradient) {
  Rng rng(RandomKey::fromSeed(2, 0), RandomStream::test, 0);
  const auto between = [&](double a, double b) { return a + (b - a) * rng.uniformDouble(); };
  const Vec2i resolution(320, 160);
  for (const char* model : {"perspective", "orthographic", "equirectangular"})
    for (int trial = 0; trial < 100; ++trial) {
      const Vec3d eye(between(-9, 9), between(-9, 9), between(-9, 9));
      const Mat4d place = lookAt(eye, {between(-9, 9), between(-9, 9), between(-9, 9)},
                                 Vec3d(sampleSphere(rng.uniform2())));
      const auto camera = makeCamera(model, {{"near", "0.3"}}, place, resolution);
      const Vec2d raster(between(0.02, 0.98) * resolution.x, between(0.02, 0.98) * resolution.y);
      const double distance = between(0.5, 30);
      const auto at = [&](const Vec2d& r, double t) {
        const CameraRay ray = camera->ray(r);
        return ray.origin + ray.direction * t;
      };
      const Vec3d p = at(raster, distance);
      const auto seen = camera->project(p);
      ASSERT_TRUE(seen) << model;
      EXPECT_NEAR(seen->raster.x, raster.x, 1e-7) << model;
      EXPECT_NEAR(seen->raster.y, raster.y, 1e-7) << model;
      // One pixel across moves x by one and y by nothing; a step along the ray moves neither.
      constexpr double h = 1e-3;
      for (int axis = 0; axis < 2; ++axis) {
        Vec2d step(0.0);
        step[axis] = h;
        const Vec3d way = (at(raster + step, distance) - at(raster - step, distance)) / (2 * h);
        for (int i = 0; i < 2; ++i)
          EXPECT_NEAR(glm::dot(seen->gradient[static_cast<std::size_t>(i)], way),
                      i == axis ? 1.0 : 0.0, 1e-4)
              << model;
      }
      const Vec3d along = camera->ray(raster).direction;
      for (const Vec3d& gradient : seen->gradient)
        EXPECT_NEAR(glm::dot(gradient, along), 0.0, 1e-8 * glm::length(gradient)) << model;
    }
  const auto ahead = makeCamera("perspective", {}, lookAt({0, 0, 5}, {0, 0, 0}, {0, 1, 0}));
  EXPECT_FALSE(ahead->project({0, 0, 6}));
  // A unit of area at distance 5 on the axis: pixels of the frame over the area that it shows.
  const double shown = 2 * 5 * std::tan(15 * kPi / 180) / 1280;
  EXPECT_NEAR(ahead->project({0, 0, 0})->pixelsPerArea(), 1 / (shown * shown), 1e-6);
}

TEST(Projection, HasSquarePixelsTheStatedViewAndYDown) {
  const Mat4d place = lookAt({0, 0, 5}, {0, 0, 0}, {0, 1, 0});
  const auto camera = makeCamera("perspective", {{"fov", "90"}}, place, {200, 100});
  const Vec3d left = camera->ray({0, 50}).direction, right = camera->ray({200, 50}).direction;
  EXPECT_NEAR(glm::dot(left, right), 0.0, 1e-15);
  EXPECT_LT(left.x, 0);
  EXPECT_GT(camera->ray({100, 0}).direction.y, 0);
  const Vec3d corner = camera->ray({200, 0}).direction;
  EXPECT_NEAR(corner.y / corner.x, 0.5, 1e-15);
  EXPECT_EQ(camera->position(), Vec3d(0, 0, 5));
  EXPECT_EQ(camera->viewDirection(), Vec3d(0, 0, -1));
  EXPECT_TRUE(camera->hasEye());
  const auto flat = makeCamera("orthographic", {{"width", "8"}}, place, {200, 100});
  EXPECT_EQ(flat->ray({0, 0}).origin, Vec3d(-4, 2, 5));
  EXPECT_EQ(flat->ray({0, 0}).direction, Vec3d(0, 0, -1));
  EXPECT_FALSE(flat->hasEye());
  // 36 mm film behind a 18 mm lens sees 90 degrees.
  const auto lens =
      makeCamera("perspective", {{"focal_length", "18"}, {"horizontal_aperture", "36"}}, place);
  EXPECT_NEAR(lens->ray({0, 360}).direction.x, -std::sqrt(0.5), 1e-15);
}

TEST(Projection, KeepsDoublePrecisionFarFromTheOrigin) {
  const Vec3d far(1e6, -1e6, 1e6);
  const auto nearby = makeCamera("perspective", {}, lookAt({1, 2, 5}, {0, 0, 0}, {0, 1, 0}));
  const auto distant = makeCamera("perspective", {}, lookAt(far + Vec3d(1, 2, 5), far, {0, 1, 0}));
  for (const Vec2d& raster : {Vec2d(0, 0), Vec2d(1280, 300), Vec2d(640.5, 719.5)}) {
    const CameraRay a = nearby->ray(raster), b = distant->ray(raster);
    EXPECT_LT(glm::length(a.direction - b.direction), 1e-12);
    EXPECT_LT(glm::length(a.origin + far - b.origin), 1e-9);
    const Vec2d ndc = project(*distant, b.origin + b.direction * 5.0);
    EXPECT_NEAR(ndc.x * 1280, raster.x, 1e-5);
    EXPECT_NEAR(ndc.y * 720, raster.y, 1e-5);
  }
}

TEST(LookAt, IsRigidForEveryUp) {
  for (const Vec3d& eye : {Vec3d(0, 5, 0), Vec3d(0, -5, 0), Vec3d(3, 0, 0), Vec3d(0, 0, -2),
                           Vec3d(1, 1, 1), Vec3d(1e-9, 5, 0)})
    for (const Vec3d& up : {Vec3d(0, 1, 0), Vec3d(0, -1, 0), Vec3d(0, 0, 1), Vec3d(1, 0, 0),
                            Vec3d(0, 1e-8, 0), Vec3d(5, 5, 5), Vec3d(0, 0, 0)}) {
      const Mat4d m = lookAt(eye, {0, 0, 0}, up);
      EXPECT_LT(rigidError(m), 1e-12);
      EXPECT_LT(glm::length(Vec3d(m[2]) - glm::normalize(eye)), 1e-14);
      const Vec3d across = glm::cross(up, glm::normalize(eye));
      if (glm::length(across) > 1e-5 * glm::length(up) && glm::length(up) > 0) {
        EXPECT_GT(glm::dot(Vec3d(m[1]), up), 0.0) << "up must stay upward";
      }
    }
  EXPECT_THROW(lookAt({1, 2, 3}, {1, 2, 3}, {0, 1, 0}), ConfigError);
  EXPECT_THROW(lookAt({std::nan(""), 2, 3}, {1, 2, 3}, {0, 1, 0}), ConfigError);
}

TEST(Options, PlaceTheCamera) {
  ParamValues values(cameraParams());
  EXPECT_EQ(worldFromCameraValues(values), lookAt({0, 0, 5}, {0, 0, 0}, {0, 1, 0}));
  // Row-major, translation in the last column, twice as large: the scale goes.
  values.setText("matrix", "[0,0,2,7, 0,2,0,8, -2,0,0,9, 0,0,0,1]", "test");
  const Mat4d m = worldFromCameraValues(values);
  EXPECT_LT(rigidError(m), 1e-14);
  EXPECT_EQ(Vec3d(m[3]), Vec3d(7, 8, 9));
  EXPECT_EQ(Vec3d(m[2]), Vec3d(1, 0, 0));
  for (const char* bad :
       {"[1,0,0,0, 0,1,0,0, 0,0,1,0, 7,8,9,1]", "[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]",
        "[1,0.1,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]", "[0,0,0,0, 0,0,0,0, 0,0,0,0, 0,0,0,1]"}) {
    values.setText("matrix", bad, "test");
    EXPECT_THROW(worldFromCameraValues(values), ConfigError) << bad;
  }
}

TEST(Options, AreChecked) {
  ParamValues values(cameraParams());
  EXPECT_THROW(values.setText("fstop", "-1", "test"), ConfigError);
  EXPECT_NO_THROW(values.setText("fstop", "0", "test"));
  EXPECT_NO_THROW(values.setText("shutter", "[0, 0.5]", "test"));
  EXPECT_THROW(values.setText("resolution", "[0, 720]", "test"), ConfigError);
  const Mat4d place(1.0);
  EXPECT_THROW(makeCamera("perspective", {{"fov", "180"}}, place), ConfigError);
  EXPECT_THROW(makeCamera("perspective", {{"fov", "30"}, {"focal_length", "35"}}, place),
               ConfigError);
  EXPECT_THROW(makeCamera("perspective", {{"width", "3"}}, place), ConfigError);
  EXPECT_THROW(makeCamera("orthographic", {{"width", "0"}}, place), ConfigError);
  EXPECT_THROW(makeCamera("orthographic", {}, place, {0, 5}), ConfigError);
}

// Ahead in the middle, right a quarter of the width on, up at the top, behind at both sides.
TEST(Panorama, SeesEveryDirectionOnce) {
  const Mat4d place = lookAt({1, 2, 3}, {1, 7, 3}, {0, 0, 1});
  const auto camera = makeCamera("equirectangular", {}, place, {400, 200});
  const auto expect = [&](const Vec2d& raster, const Vec3d& direction) {
    const CameraRay ray = camera->ray(raster);
    EXPECT_LT(glm::length(ray.direction - direction), 1e-12) << raster.x << ' ' << raster.y;
    EXPECT_EQ(ray.origin, Vec3d(1, 2, 3));
  };
  expect({200, 100}, {0, 1, 0});
  expect({300, 100}, {1, 0, 0});
  expect({100, 100}, {-1, 0, 0});
  expect({0, 100}, {0, -1, 0});
  expect({400, 100}, {0, -1, 0});
  expect({123, 0}, {0, 0, 1});
  expect({321, 200}, {0, 0, -1});
  // Over the pole: the other side of it.
  EXPECT_LT(glm::length(camera->ray({50, -10}).direction - camera->ray({250, 10}).direction),
            1e-12);
  EXPECT_TRUE(camera->isPanorama());
  EXPECT_TRUE(camera->hasEye());
  EXPECT_FALSE(camera->ndcFromWorld());
  const auto later = makeCamera("equirectangular", {{"near", "2"}}, place, {400, 200});
  EXPECT_LT(glm::length(later->ray({300, 100}).origin - Vec3d(3, 2, 3)), 1e-12);
}

}  // namespace
}  // namespace photosphere::cameras
