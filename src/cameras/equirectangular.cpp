// The whole sphere of directions around the eye.

#include <cmath>

#include "placed_camera.h"

namespace photosphere::cameras::plugins {

namespace {

class Equirectangular final : public PlacedCamera {
 public:
  Equirectangular(const Mat4d& worldFromCamera, const Vec2i& resolution, double near)
      : PlacedCamera(worldFromCamera, resolution, 1.0), m_near(near) {}

  // Beyond the upper and lower border rays go on over the poles, beyond the sides around.
  CameraRay ray(const Vec2d& raster) const override {
    const double longitude = (2 * raster.x / resolution().x - 1) * kPi;
    const double latitude = (0.5 - raster.y / resolution().y) * kPi;
    const Vec3d direction =
        std::cos(latitude) * (std::sin(longitude) * right() - std::cos(longitude) * back()) +
        std::sin(latitude) * up();
    return {position() + direction * m_near, glm::normalize(direction)};
  }

  std::optional<Projection> project(const Vec3d& world) const override {
    const Vec3d v = world - position();
    const double side = glm::dot(v, right()), ahead = -glm::dot(v, back()),
                 rise = glm::dot(v, up());
    const double level2 = side * side + ahead * ahead, level = std::sqrt(level2);
    if (!(level2 > 0)) return std::nullopt;  // at the poles, which are no one's place
    const Vec2d perRadian(resolution().x / (2 * kPi), resolution().y / kPi);
    Projection p;
    p.raster = Vec2d(0.5 * resolution().x, 0.5 * resolution().y) +
               perRadian * Vec2d(std::atan2(side, ahead), -std::atan2(rise, level));
    const Vec3d outward = (side * right() - ahead * back()) / level;
    p.gradient[0] = perRadian.x / level2 * (ahead * right() + side * back());
    p.gradient[1] = -perRadian.y / (level2 + rise * rise) * (level * up() - rise * outward);
    return p;
  }

  bool hasEye() const override { return true; }
  bool isPanorama() const override { return true; }

 private:
  double m_near;  // [scene units]
};

constexpr Param params[] = {nearRow()};

std::unique_ptr<Camera> create(const ParamValues& values, const Mat4d& worldFromCamera,
                               const Vec2i& resolution) {
  return std::make_unique<Equirectangular>(worldFromCamera, resolution, values.real("near"));
}

}  // namespace

extern const CameraPlugin equirectangular;
const CameraPlugin equirectangular = {
    .name = "equirectangular",
    .help = "a panorama of 360 by 180 degrees, ahead in the middle, up at the top",
    .params = params,
    .create = create,
};

}  // namespace photosphere::cameras::plugins
