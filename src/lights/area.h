#pragma once
// What lamps with a surface share: the power of its points toward the smoke.

#include "cone.h"
#include "rows.h"
#include "trigonometry.h"

namespace photosphere::lights {

/// Integral of max(0, cos) to a surface normal over a cone of directions [sr], between 0 and pi.
/// The horizon may cut the cone: Snyder 1996, "Area light sources for real-time graphics", as in
/// Lagarde & de Rousiers 2014, listing 11.
/// @param normal  unit
inline double projectedSolidAngle(const Vec3d& normal, const Cone& cone) {
  if (cone.oneMinusCos >= 2.0) return kPi;
  const double cosine = glm::clamp(glm::dot(normal, cone.axis), -1.0, 1.0);
  const double sineSquared = cone.oneMinusCos * (2 - cone.oneMinusCos);  // of the half angle
  if (cosine * cosine > sineSquared) return kPi * sineSquared * std::max(0.0, cosine);
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  const double x = std::sqrt(std::max(1e-300, 1 / sineSquared - 1));
  const double y = glm::clamp(-x * (cosine / sine), -1.0, 1.0);
  const double z = sine * std::sqrt(std::max(0.0, 1 - y * y));
  const double arctangent = exactAsin((z / x) / std::sqrt(1 + (z / x) * (z / x)));
  return (cosine * exactAcos(y) - x * z) * sineSquared + arctangent;
}

/// A photon direction from a point of a surface toward the sphere, and what its power is multiplied
/// by [sr]. From inside the sphere it falls off with the cosine, from outside it fills the cone.
struct Departure {
  Vec3d direction{0.0};
  double weight = 0;
};
inline Departure departure(const Vec3d& from, const Vec3d& normal, const BoundingSphere& bounds,
                           float u, float turns) {
  const Cone cone = coneToward(from, bounds);
  if (cone.oneMinusCos >= 2.0) {
    // 1 - cos with density proportional to cos.
    const double h = 1 - std::sqrt(1 - static_cast<double>(u));
    return {directionInCone(normal, h, turns), kPi};
  }
  const Vec3d direction =
      directionInCone(cone.axis, static_cast<double>(u) * cone.oneMinusCos, turns);
  return {direction, std::max(0.0, glm::dot(direction, normal)) * cone.solidAngle()};
}

/// Points along one side of a surface at most, for the mean of its points' power.
inline constexpr int kSurfaceNodes = 48;

/// A point of a lamp's surface.
struct SurfacePoint {
  Vec3d position{0.0};  ///< local space [m]
  Vec3d normal{0.0};    ///< unit, to the side that shines
};

/// A lamp of even radiance.
class SurfaceLight : public Light {
 public:
  /// @param radiance  [W m^-2 sr^-1]
  explicit SurfaceLight(const Rgb& radiance) : m_radiance(radiance) {}

  Rgb power(const BoundingSphere& bounds) const override {
    return m_radiance * static_cast<float>(etendue(bounds, nodes(bounds)));
  }

  /// Of a few points: all of a flat lamp see the sphere before them, or none.
  Rgb roughPower(const BoundingSphere& bounds) const override {
    constexpr int kRough = 8;
    const Vec2i count = nodes(bounds);
    return m_radiance * static_cast<float>(
                            etendue(bounds, count.y > 1 ? glm::min(count, Vec2i(kRough)) : count));
  }

  Emission emit(const BoundingSphere& bounds, const Vec4f& u) const override {
    const SurfacePoint p = surface({u.x, u.y}, bounds);
    const Departure d = departure(p.position, p.normal, bounds, u.z, u.w);
    return {photonOrigin(p.position, d.direction, bounds), Vec3f(d.direction),
            m_radiance * static_cast<float>(d.weight * area())};
  }

  /// From any point of the body at once; no sky holds more of it than its half.
  Reach reach(const BoundingSphere& bounds) const override {
    const double radiance = maxComponent(Vec3d(m_radiance));
    Reach reach = reachFrom(center(), extent(), radiance * area(), bounds);
    reach.fluence = isBehind(bounds) ? 0.0 : std::min(reach.fluence, 2 * kPi * radiance);
    reach.radiance = radiance;
    return reach;
  }

  bool isDelta() const override { return false; }
  std::optional<Place> place() const override { return Place{center(), extent()}; }
  bool isGrey() const override { return isGreyColor(m_radiance); }

 protected:
  const Rgb& radiance() const { return m_radiance; }
  /// Of even density over the surface. @param u  in [0, 1)^2
  /// @param bounds  of the smoke, toward which a round surface may lay out its points
  virtual SurfacePoint surface(const Vec2f& u, const BoundingSphere& bounds) const = 0;
  /// How many points along each side tell the mean power of all. Many lamps ask for it often.
  virtual Vec2i nodes(const BoundingSphere& bounds) const = 0;
  virtual double area() const = 0;  ///< [m^2]
  virtual const Vec3d& center() const = 0;
  virtual double extent() const = 0;  ///< of no point from the centre more [m]
  /// True when the whole sphere lies on a side that stays dark.
  virtual bool isBehind(const BoundingSphere& bounds) const {
    (void)bounds;
    return false;
  }

 private:
  // Of the surface and directions that reach the sphere, by so many points [m^2 sr].
  double etendue(const BoundingSphere& bounds, const Vec2i& count) const {
    if (glm::length(center() - bounds.center) + extent() <= bounds.radius) return kPi * area();
    double sum = 0;
    for (int i = 0; i < count.x; ++i)
      for (int j = 0; j < count.y; ++j) {
        const SurfacePoint p = surface((Vec2f(i, j) + 0.5f) / Vec2f(count), bounds);
        sum += projectedSolidAngle(p.normal, coneToward(p.position, bounds));
      }
    return sum * area() / (count.x * count.y);
  }

  Rgb m_radiance;
};

/// A flat lamp that shines to one side.
class FlatLight : public SurfaceLight {
 public:
  /// @param axis  unit, the side it shines to
  FlatLight(const Vec3d& center, const Vec3d& axis, const Rgb& radiance)
      : SurfaceLight(radiance), m_center(center), m_axis(axis) {}

  Illumination illuminate(const Vec3f& point, const Vec2f& u) const override {
    Vec3d direction;
    Illumination result = PointSource(m_center + offset(u), radiance() * static_cast<float>(area()))
                              .illuminate(point, direction);
    result.irradiance *= static_cast<float>(std::max(0.0, glm::dot(direction, m_axis)));
    return result;
  }

 protected:
  /// From the centre to a point of even density over the surface [m]. @param u  in [0, 1)^2
  virtual Vec3d offset(const Vec2f& u) const = 0;

 private:
  SurfacePoint surface(const Vec2f& u, const BoundingSphere&) const override {
    return {m_center + offset(u), m_axis};
  }

  // The power of a point changes over its distance from the sphere. Of n along a side the mean is
  // off by (extent / distance / n)^2 / 2 of it: 1e-5, where n is not the most.
  Vec2i nodes(const BoundingSphere& bounds) const override {
    constexpr double kFewest = 4.0, kFine = 224.0;
    const double distance = glm::length(m_center - bounds.center) - bounds.radius;
    const double wanted = kFine * extent() / std::max(distance, 1e-300);
    return Vec2i(static_cast<int>(std::ceil(glm::clamp(wanted, kFewest, kSurfaceNodes * 1.0))));
  }
  const Vec3d& center() const override { return m_center; }
  bool isBehind(const BoundingSphere& bounds) const override {
    return glm::dot(bounds.center - m_center, m_axis) + bounds.radius <= 0;
  }

  Vec3d m_center, m_axis;
};

/// What `intensity` is of a lamp with a surface.
constexpr Param radianceRow() {
  return intensityRow("W m^-2 sr^-1", "radiance where the color is 1");
}

}  // namespace photosphere::lights
