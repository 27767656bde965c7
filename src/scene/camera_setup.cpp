#include "camera_setup.h"

#include <fmt/format.h>

#include <cmath>

#include "photosphere/core/error.h"
#include "photosphere/core/registry.h"

namespace photosphere::scene {

namespace {

// The width at which parallel rays from `placement` see the whole box.
double widthOfBox(const Box3d& box, const Vec3d& target, const Mat4d& placement,
                  const Vec2i& resolution) {
  double half = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d d = box.corner(corner) - target;
    const double x = std::abs(glm::dot(d, Vec3d(placement[0])));
    const double y = std::abs(glm::dot(d, Vec3d(placement[1])));
    half = std::max(half, std::max(x, y * resolution.x / resolution.y));
  }
  return 2 * half;
}

// The camera that its values describe.
std::unique_ptr<cameras::Camera> cameraOf(const SceneFile& scene, ParamValues values,
                                          const Box3d& smoke) {
  const cameras::CameraPlugin& plugin =
      findPlugin(cameras::cameraModels(), scene.cameraType, "camera type", scene.cameraWhere);
  const Vec2i resolution(values.vec2("resolution"));
  try {
    if (!scene.framesSmoke() || smoke.empty())
      return plugin.create(values, cameras::worldFromCameraValues(values), resolution);
    const Vec3d target = values.given("look_at") ? values.vec3("look_at") : smoke.center();
    const double fov = scene.cameraType == "perspective" ? horizontalFov(values) : 30.0;
    const Mat4d placement = frameBox(smoke, target, values.vec3("up"), fov, resolution);
    if (scene.cameraType == "orthographic" && !values.given("width"))
      values.set("width", widthOfBox(smoke, target, placement, resolution), scene.cameraWhere);
    return plugin.create(values, placement, resolution);
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}: {}", scene.cameraWhere, error.what()));
  }
}

void setView(const cameras::Placement& place, FrameSetup& setup) {
  setup.view.hasEye = setup.camera->hasEye();
  setup.view.eye = setup.space.localFromWorld(place.eye);
  setup.view.direction = Vec3f(place.axis);
}

// Frames at which something that moves the camera has a key; empty where nothing does.
std::vector<double> motionKeys(const SceneFile& scene) {
  std::vector<double> frames;
  for (const Tracks* tracks : {&scene.cameraKeys, &scene.shot})
    for (const auto& [name, track] : *tracks)
      if (name != "shutter" && name != "fstop" && name != "focus_distance")
        for (const Key& key : track)
          frames.push_back(key.frame);
  return frames;
}

}  // namespace

double horizontalFov(const ParamValues& camera) {
  if (camera.given("focal_length") || camera.given("horizontal_aperture"))
    return 2 * std::atan(camera.real("horizontal_aperture") / 2 / camera.real("focal_length")) *
           180 / kPi;
  return camera.real("fov");
}

void buildCamera(const SceneFile& scene, FrameSetup& setup) {
  setup.camera = cameraOf(scene, scene.camera, setup.worldBounds);
  setView(cameras::placementOf(*setup.camera), setup);
  if (scene.framesSmoke()) {
    if (!setup.worldBounds.empty())
      setup.notes.push_back(
          "[camera] has neither 'position' nor 'matrix': it frames the smoke of each frame anew; "
          "place it to hold it still over a sequence");
    return;
  }
  const Vec2d shutter = scene.camera.vec2("shutter");
  const std::vector<double> keys = motionKeys(scene);
  if (keys.empty() || shutter.y == shutter.x || scene.effects.text("motion_blur") == "off") return;
  const auto frame = static_cast<double>(setup.frame);
  setup.motion = std::make_unique<cameras::MovingCamera>(
      [&](double time) { return cameraOf(scene, cameraAt(scene, time), setup.worldBounds); },
      frame + shutter.x, frame + shutter.y, keys, setup.worldBounds);
}

void viewFromTheMiddle(FrameSetup& setup) {
  if (setup.motion) setView(setup.motion->placement(0.5), setup);
}

Mat4d frameBox(const Box3d& box, const Vec3d& target, const Vec3d& up, double fovDegrees,
               const Vec2i& resolution) {
  // The front is +Z where Y is up, -Y where Z is up.
  const bool zUp = std::abs(up.z) > std::abs(up.y);
  const Vec3d toEye = glm::normalize(zUp ? Vec3d(0.5, -1.0, 0.3) : Vec3d(0.5, 0.3, 1.0));
  const Mat4d axes = cameras::lookAt(target + toEye, target, up);
  const double tanX = std::tan(fovDegrees * kPi / 360);
  const double tanY = tanX * resolution.y / resolution.x;
  double distance = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d d = box.corner(corner) - target;
    const double x = std::abs(glm::dot(d, Vec3d(axes[0])));
    const double y = std::abs(glm::dot(d, Vec3d(axes[1])));
    distance = std::max(distance, std::max(x / tanX, y / tanY) + glm::dot(d, toEye));
  }
  return cameras::lookAt(target + toEye * std::max(distance, 1e-9), target, up);
}

}  // namespace photosphere::scene
