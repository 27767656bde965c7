#pragma once
// Cameras: the table of models and the rays they make.

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "photosphere/core/param.h"
#include "photosphere/core/types.h"

namespace photosphere::cameras {

/// A ray in world space [scene units]; `direction` is unit.
struct CameraRay {
  Vec3d origin{0.0};
  Vec3d direction{0.0, 0.0, -1.0};
};

/// Where a point is seen.
struct Projection {
  Vec2d raster{0.0};  ///< as Camera::ray takes it [pixels]
  /// Of raster.x and raster.y over the point [pixels / scene unit].
  std::array<Vec3d, 2> gradient{};
  /// Of the picture on which an area at the point falls that faces the ray
  /// [pixels^2 / scene unit^2].
  double pixelsPerArea() const { return glm::length(glm::cross(gradient[0], gradient[1])); }
};

/// A camera of one frame. World: right-handed; the camera looks along its -Z.
class Camera {
 public:
  virtual ~Camera() = default;
  /// The ray through a raster position [pixels, y down, (0,0) = upper left corner of the frame].
  virtual CameraRay ray(const Vec2d& raster) const = 0;
  /// Eye position for a perspective camera.
  /// @return false when the camera has no single eye (orthographic): then `direction` is the view
  ///         direction everywhere.
  virtual bool hasEye() const = 0;
  Vec3d position() const { return Vec3d(worldFromCamera()[3]); }
  /// Unit direction along which the camera looks, world space.
  Vec3d viewDirection() const { return -glm::normalize(Vec3d(worldFromCamera()[2])); }
  virtual const Mat4d& worldFromCamera() const = 0;
  /// RenderMan's worldToCamera: left-handed camera space, +Z forward, column vectors (the EXR
  /// attribute holds its transpose, as OpenEXR's row vectors want).
  virtual Mat4d cameraFromWorld() const = 0;
  /// True for a camera around which the picture goes: depth is then the distance from the eye, not
  /// along an axis.
  virtual bool isPanorama() const { return false; }
  /// RenderMan's worldToNDC: (0,0) upper left, (1,1) lower right after the homogeneous division.
  /// Nothing for a panorama, which no matrix projects.
  virtual std::optional<Mat4d> ndcFromWorld() const { return std::nullopt; }
  /// The raster position, within the frame or not, whose ray passes a point of world space: the
  /// inverse of `ray`, but for where rays begin. Nothing where there is none.
  virtual std::optional<Projection> project(const Vec3d& world) const;
  virtual Vec2i resolution() const = 0;
};

struct CameraPlugin {
  std::string_view name;
  std::string_view help;
  std::span<const Param> params;  ///< its own options; those common to all are cameraParams()
  std::unique_ptr<Camera> (*create)(const ParamValues& values, const Mat4d& worldFromCamera,
                                    const Vec2i& resolution);
};

/// Options common to all cameras: place, resolution, shutter and lens. Whoever builds a camera
/// turns them into the matrix and resolution that `create` takes.
std::span<const Param> cameraParams();

/// World from camera as the options common to all cameras say: `matrix` where given, else `lookAt`
/// of `position`, `look_at` and `up`.
/// @throws ConfigError for a matrix that is not a rigid motion times a positive scale; the scale is
///         removed
Mat4d worldFromCameraValues(const ParamValues& common);

/// Every camera (generated).
std::span<const CameraPlugin* const> cameraModels();

/// World from camera for an eye that looks at a point. A view along `up` takes another up. Rigid.
/// @throws ConfigError when eye and target coincide
Mat4d lookAt(const Vec3d& eye, const Vec3d& target, const Vec3d& up);

}  // namespace photosphere::cameras
