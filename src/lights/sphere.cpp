// A ball that shines outward.

#include "area.h"

namespace photosphere::lights::plugins {

namespace {

class SphereLight final : public Light {
 public:
  SphereLight(const Vec3d& center, const Rgb& radiance, double radius)
      : m_center(center), m_radiance(radiance), m_radius(radius) {}

  Rgb power(const BoundingSphere& bounds) const override {
    double sum = 0;
    for (int i = 0; i < kSurfaceNodes; ++i)
      for (int j = 0; j < kSurfaceNodes; ++j) {
        const Vec3d normal = normalAt({(static_cast<float>(i) + 0.5f) / kSurfaceNodes,
                                       (static_cast<float>(j) + 0.5f) / kSurfaceNodes},
                                      toSmoke(bounds));
        sum += projectedSolidAngle(normal, coneToward(m_center + normal * m_radius, bounds));
      }
    return m_radiance * static_cast<float>(sum * area() / (kSurfaceNodes * kSurfaceNodes));
  }

  Emission emit(const BoundingSphere& bounds, const Vec4f& u) const override {
    const Vec3d normal = normalAt({u.x, u.y}, toSmoke(bounds));
    const Vec3d from = m_center + normal * m_radius;
    const Departure d = departure(from, normal, bounds, u.z, u.w);
    return {photonOrigin(from, d.direction, bounds), Vec3f(d.direction),
            m_radiance * static_cast<float>(d.weight * area())};
  }

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
    result.irradiance = m_radiance * static_cast<float>(cone.solidAngle());
    return result;
  }

  bool isDelta() const override { return false; }
  bool isGrey() const override { return isGreyColor(m_radiance); }

 private:
  double area() const { return 4 * kPi * m_radius * m_radius; }
  Vec3d toSmoke(const BoundingSphere& bounds) const {
    const Vec3d d = bounds.center - m_center;
    const double length = glm::length(d);
    return length > 0 ? d / length : Vec3d(0, 0, 1);
  }
  // Even over the ball; about an axis, so that the nodes of power() meet the horizon evenly.
  static Vec3d normalAt(const Vec2f& u, const Vec3d& axis) {
    return directionInCone(axis, 2 * static_cast<double>(u.x), u.y);
  }

  Vec3d m_center;
  Rgb m_radiance;  // [W m^-2 sr^-1]
  double m_radius;
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
