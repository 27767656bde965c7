// A ball that shines outward.

#include "area.h"

namespace photosphere::lights::plugins {

namespace {

class SphereLight final : public SurfaceLight {
 public:
  SphereLight(const Vec3d& center, const Rgb& radiance, double radius)
      : SurfaceLight(radiance), m_center(center), m_radius(radius) {}

  /// Fills the cone that the ball takes up in the sky of the point evenly. Dark inside the ball.
  Illumination illuminate(const Vec3f& point, const Vec2f& u) const override {
    const Vec3d from(point), to = m_center - from;
    const double squared = glm::dot(to, to);
    Illumination result;
    if (!(squared > m_radius * m_radius)) return {Vec3f(0, 0, 1), 0.0f, Rgb(0.0f)};
    const Cone cone = coneToward(from, {m_center, m_radius});
    const Vec3d toLamp =
        directionInCone(cone.axis, static_cast<double>(u.x) * cone.oneMinusCos, u.y);
    const double along = glm::dot(to, toLamp);
    const Vec3d beside = to - toLamp * along;  // from the ray's nearest point to the centre
    const double half = std::sqrt(std::max(0.0, m_radius * m_radius - glm::dot(beside, beside)));
    result.direction = Vec3f(-toLamp);
    result.distance = static_cast<float>(along - half);
    result.irradiance = radiance() * static_cast<float>(cone.solidAngle());
    return result;
  }

 private:
  // About an axis toward the smoke, so that the nodes of power() meet the horizon evenly.
  SurfacePoint surface(const Vec2f& u, const BoundingSphere& bounds) const override {
    const Vec3d d = bounds.center - m_center;
    const double length = glm::length(d);
    const Vec3d axis = length > 0 ? d / length : Vec3d(0, 0, 1);
    const Vec3d normal = directionInCone(axis, 2 * static_cast<double>(u.x), u.y);
    return {m_center + normal * m_radius, normal};
  }
  double area() const override { return 4 * kPi * m_radius * m_radius; }
  const Vec3d& center() const override { return m_center; }
  double extent() const override { return m_radius; }

  Vec3d m_center;
  double m_radius;  // [m]
};

constexpr Param params[] = {
    positionRow("of its centre"),
    colorRow(),
    radianceRow(),
    bodyRadiusRow(),
};

std::unique_ptr<Light> create(const ParamValues& values, const LocalSpace& space) {
  return std::make_unique<SphereLight>(space.localFromWorld(values.vec3("position")),
                                       scaledColor(values),
                                       values.real("radius") * space.metersPerUnit);
}

}  // namespace

extern const LightPlugin sphere;
const LightPlugin sphere = {
    .name = "sphere",
    .help = "a ball that shines outward",
    .params = params,
    .create = create,
};

}  // namespace photosphere::lights::plugins
