#pragma once
// A ball that shines outward, for lamps that are one and for soft points and spots.

#include "area.h"

namespace photosphere::lights {

/// Radiance of a ball that far away has the intensity of a point [W m^-2 sr^-1].
/// @param intensity  [W/sr]
/// @param radius     [m]
inline Rgb ballRadiance(const Rgb& intensity, double radius) {
  return intensity * static_cast<float>(1 / (kPi * radius * radius));
}

/// How far it is to a ball in a direction that meets it [m]; to its nearest point where rounding
/// makes the direction miss.
/// @param to         from where one looks to the centre [m]
/// @param direction  unit
inline double distanceToBall(const Vec3d& to, const Vec3d& direction, double radius) {
  const Chord chord(to, direction, radius);
  return chord.middle - std::sqrt(std::max(0.0, chord.halfSquared));
}

/// A ball of even radiance, dark inside.
class BallLight : public SurfaceLight {
 public:
  /// @param center    local space [m]
  /// @param radiance  [W m^-2 sr^-1]
  /// @param radius    [m]
  BallLight(const Vec3d& center, const Rgb& radiance, double radius)
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
    result.direction = Vec3f(-toLamp);
    result.distance = static_cast<float>(distanceToBall(to, toLamp, m_radius));
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
    return {m_center + normal * m_radius, normal, area()};
  }
  // Points at the same angle to that axis have the same power.
  Vec2i nodes(const BoundingSphere&) const override { return {kSurfaceNodes, 1}; }
  double area() const override { return 4 * kPi * m_radius * m_radius; }
  const Vec3d& center() const override { return m_center; }
  double extent() const override { return m_radius; }
  double halfWidth() const override { return m_radius; }
  double nearest(const Vec3d& point) const override {
    return std::max(0.0, glm::length(point - m_center) - m_radius);
  }
  Cone headings(const BoundingSphere& bounds) const override {
    return coneToward(m_center, {bounds.center, bounds.radius + m_radius});
  }
  std::optional<double> departs(const Vec3d& origin, const Vec3d& direction) const override {
    const Chord chord(m_center - origin, direction, m_radius);
    if (!(chord.halfSquared > 0)) return {};
    return chord.middle + std::sqrt(chord.halfSquared);
  }
  bool isBehind(const BoundingSphere& bounds) const override {
    return glm::length(bounds.center - m_center) + bounds.radius <= m_radius;
  }

  Vec3d m_center;
  double m_radius;  // [m]
};

}  // namespace photosphere::lights
