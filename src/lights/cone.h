#pragma once
// Cones of directions from a light, in double: a light may be a million radii away from the smoke.

#include <cmath>

#include "photosphere/core/fast_math.h"
#include "photosphere/lights/light.h"

namespace photosphere::lights {

/// Directions within an angle of an axis. The angle is held as 1 - cos, which keeps narrow cones
/// exact; 2 = all directions.
struct Cone {
  Vec3d axis{0.0, 0.0, 1.0};
  double oneMinusCos = 2.0;

  double solidAngle() const { return 2 * kPi * oneMinusCos; }
};

/// 1 - cos of the angle between two unit vectors, exact for nearly equal ones.
inline double oneMinusCosBetween(const Vec3d& a, const Vec3d& b) {
  const Vec3d d = a - b;
  return 0.5 * glm::dot(d, d);
}

/// The directions from `from` that meet the sphere; all of them from inside.
inline Cone coneToward(const Vec3d& from, const BoundingSphere& bounds) {
  const Vec3d d = bounds.center - from;
  const double squared = glm::dot(d, d), radiusSquared = bounds.radius * bounds.radius;
  if (!(squared > radiusSquared)) return {};
  const double sineSquared = radiusSquared / squared;
  return {d / std::sqrt(squared), sineSquared / (1 + std::sqrt(1 - sineSquared))};
}

/// A line and a ball: where the line is nearest to the centre, and the square of half its chord.
struct Chord {
  double middle = 0;       ///< along the line [m]
  double halfSquared = 0;  ///< below 0 where it misses the ball [m^2]

  /// @param to         from where the line is counted to the centre [m]
  /// @param direction  unit
  Chord(const Vec3d& to, const Vec3d& direction, double radius) : middle(glm::dot(to, direction)) {
    const Vec3d beside = to - direction * middle;
    halfSquared = radius * radius - glm::dot(beside, beside);
  }
};

/// Unit vectors across a unit axis (Duff et al. 2017), in double.
struct Across {
  Vec3d x, y;

  explicit Across(const Vec3d& n) {
    const double s = std::copysign(1.0, n.z);
    const double a = -1.0 / (s + n.z);
    const double b = n.x * n.y * a;
    x = {1.0 + s * n.x * n.x * a, s * b, -s * n.x};
    y = {b, s + n.y * n.y * a, -n.y};
  }
};

/// The direction at 1 - cos = `h` from the axis and a turn in [0, 1] about it.
inline Vec3d directionInCone(const Vec3d& axis, double h, float turns) {
  const Across across(axis);
  const double sine = std::sqrt(glm::max(0.0, h * (2 - h)));
  const SinCos phi = fastSinCosTurns(turns);
  return glm::normalize(
      (across.x * static_cast<double>(phi.cos) + across.y * static_cast<double>(phi.sin)) * sine +
      axis * (1 - h));
}

/// Where a photon starts that leaves `position` in `direction`: there, or, for a light farther than
/// 64 radii, on the same line just before the sphere. A float direction is off by 6e-8 of the
/// distance flown, which from a million radii would pull the photons onto a lattice.
inline Vec3d photonOrigin(const Vec3d& position, const Vec3d& direction,
                          const BoundingSphere& bounds) {
  const double distance = glm::length(bounds.center - position);
  if (distance < 64 * bounds.radius) return position;
  return position + direction * glm::max(0.0, distance - bounds.radius);
}

/// What a body of one radiance, or a point of one intensity, can bring to a sphere: all that it
/// sends out stands `extent` or nearer to its centre.
/// @param strength  [W/sr]: intensity of a point, radiance times area of a body
inline Reach reachFrom(const Vec3d& position, double extent, double strength,
                       const BoundingSphere& bounds) {
  const Cone cone = coneToward(position, {bounds.center, bounds.radius + extent});
  const double nearest =
      glm::max(0.0, glm::length(bounds.center - position) - bounds.radius - extent);
  Reach reach;
  // 1/d^2 stops growing where a float position cannot tell the distance (PointSource).
  const double floor = glm::max(1e-9, 1e-7 * glm::length(position));
  reach.fluence = strength > 0 ? strength / std::pow(glm::max(nearest, floor), 2.0) : 0.0;
  reach.background = 0.0;
  reach.axis = cone.axis;
  reach.oneMinusCos = cone.oneMinusCos;
  return reach;
}

/// A photon origin on the disc across `direction` that covers the sphere, one radius before its
/// centre.
inline Vec3d discOrigin(const Vec3d& direction, const BoundingSphere& bounds, const Vec2f& disc) {
  const Across across(direction);
  return bounds.center + bounds.radius * (across.x * static_cast<double>(disc.x) +
                                          across.y * static_cast<double>(disc.y) - direction);
}

}  // namespace photosphere::lights
