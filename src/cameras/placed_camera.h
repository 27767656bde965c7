#pragma once
// What the camera models share: a rigid placement, a resolution and a window on the image plane.

#include "photosphere/cameras/camera.h"

namespace photosphere::cameras {

/// A camera with a window of square pixels, centred on its axis. Matrices are formed in double from
/// the placement alone, so that nothing cancels far from the origin.
class PlacedCamera : public Camera {
 public:
  /// @param halfWidth  half the window's width: in units of the distance for a perspective camera,
  /// in
  ///                   scene units for an orthographic one
  /// @throws ConfigError for a resolution or placement that makes no image
  PlacedCamera(const Mat4d& worldFromCamera, const Vec2i& resolution, double halfWidth);

  const Mat4d& worldFromCamera() const override { return m_worldFromCamera; }
  Mat4d cameraFromWorld() const override;
  Vec2i resolution() const override { return m_resolution; }

 protected:
  /// Position on the window of a raster position: x right, y up, in units of halfWidth's.
  Vec2d window(const Vec2d& raster) const {
    return {(2 * raster.x / m_resolution.x - 1) * m_half.x,
            (1 - 2 * raster.y / m_resolution.y) * m_half.y};
  }
  const Vec2d& halfWindow() const { return m_half; }
  Vec3d right() const { return Vec3d(m_worldFromCamera[0]); }
  Vec3d up() const { return Vec3d(m_worldFromCamera[1]); }
  Vec3d back() const { return Vec3d(m_worldFromCamera[2]); }

 private:
  Mat4d m_worldFromCamera;
  Vec2i m_resolution;
  Vec2d m_half;
};

/// The `near` row of a camera [scene units].
constexpr Param nearRow() {
  return {.name = "near",
          .type = ParamType::real,
          .unit = "scene units",
          .defaultText = "0.0",
          .help = "distance before the camera where rays begin",
          .min = 0.0};
}

}  // namespace photosphere::cameras
