#include "blur.h"

#include <algorithm>
#include <cmath>

#include "camera_setup.h"
#include "photosphere/render/view_importance.h"

namespace photosphere::scene {

namespace {

// Along the camera's axis [scene units].
double along(const FrameSetup& setup, const Vec3d& p) {
  return glm::dot(p - setup.camera->position(), setup.camera->viewDirection());
}

}  // namespace

DirectionCone seenDirections(const SceneFile& scene, const FrameSetup& setup) {
  constexpr double border = 8, rounding = 1e-5;
  DirectionCone cone;
  cone.axis = -setup.camera->viewDirection();
  if (setup.camera->isPanorama() || setup.motion) return cone;
  cone.angle = rounding;
  const Vec2d size(setup.camera->resolution());
  const double beyond = border + scene.render.real("filter_width");
  for (const Vec2d& corner : {Vec2d(-beyond), Vec2d(size.x + beyond, -beyond),
                              Vec2d(-beyond, size.y + beyond), size + beyond}) {
    const Vec3d seen = -setup.camera->ray(corner).direction;
    cone.angle = std::max(cone.angle, std::acos(std::min(1.0, glm::dot(seen, cone.axis))));
  }
  cone.angle += std::atan2(setup.lens.radius, setup.lens.focusDistance) + rounding;
  return cone;
}

std::vector<glm::dvec4> seenPlanes(const SceneFile& scene, const FrameSetup& setup,
                                   const render::Crop& crop) {
  const double width = scene.render.real("filter_width");
  // Half of the widest filter that is chosen by its kind, and rounding to whole pixels.
  const double border = 2 + 0.5 * (width > 0 ? width : 3);
  return render::viewPlanes(*setup.camera, crop, border, setup.space);
}

double pixelsPerUnit(const SceneFile& scene, const FrameSetup& setup) {
  const cameras::Camera& camera = *setup.camera;
  const double width = camera.resolution().x;
  const Box3d& box = setup.worldBounds;
  if (!camera.hasEye())
    return 1 / glm::length(camera.ray({1, 0}).origin - camera.ray({0, 0}).origin);
  const Vec3d eye = camera.position();
  const double distance = std::max(glm::length(box.nearest(eye) - eye), 1e-9);
  return camera.isPanorama()
             ? width / (2 * kPi * distance)
             : width / (2 * std::tan(horizontalFov(scene.camera) * kPi / 360) * distance);
}

render::Lens lensOf(const SceneFile& scene, const FrameSetup& setup) {
  const ParamValues& camera = scene.camera;
  const double millimetres =
      camera.given("focal_length")
          ? camera.real("focal_length")
          : camera.real("horizontal_aperture") / 2 / std::tan(horizontalFov(camera) * kPi / 360);
  const double focus = camera.real("focus_distance");
  return {millimetres / 1000 / setup.space.metersPerUnit / (2 * camera.real("fstop")),
          focus > 0 ? focus : std::max(1e-6, along(setup, setup.worldBounds.center()))};
}

double widestBlur(const SceneFile& scene, const FrameSetup& setup) {
  const Box3d& box = setup.worldBounds;
  if (box.empty()) return 0;
  double nearest = 1e300, farthest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const double d = along(setup, box.corner(corner));
    nearest = std::min(nearest, d);
    farthest = std::max(farthest, d);
  }
  const double tanHalf = std::tan(horizontalFov(scene.camera) * kPi / 360);
  const double pixels = setup.camera->resolution().x / (2 * tanHalf);
  const render::Lens& lens = setup.lens;
  const auto blur = [&](double d) {
    return 2 * lens.radius * pixels * std::abs(1 / std::max(d, 1e-6) - 1 / lens.focusDistance);
  };
  return std::max(blur(nearest), blur(farthest));
}

}  // namespace photosphere::scene
