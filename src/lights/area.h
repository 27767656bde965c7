#pragma once
// What lamps with a surface share: the power of its points toward the smoke, and of the lines
// through the smoke that come from it.

#include <optional>

#include "cone.h"
#include "photosphere/core/sampling.h"
#include "photosphere/core/sequence.h"
#include "rows.h"
#include "spherical_rectangle.h"

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
  double area = 0;      ///< of the surface, were its points as dense everywhere as here [m^2]
};

/// A lamp of even radiance. Its photons start at points of its surface, or, where that is so large
/// and near that few of them see much of the smoke, along even lines through the smoke's
/// sphere, of which those count that come from the lamp.
class SurfaceLight : public Light {
 public:
  /// @param radiance  [W m^-2 sr^-1]
  explicit SurfaceLight(const Rgb& radiance) : m_radiance(radiance) {}

  /// By lines to some 0.3 %.
  Rgb power(const BoundingSphere& bounds) const override {
    constexpr int kLines = 4096;
    return m_radiance * static_cast<float>(fromSphere(bounds) ? etendueOfLines(bounds, kLines)
                                                              : etendue(bounds, nodes(bounds)));
  }

  /// Of a few points: all of a flat lamp see the sphere before them, or none.
  Rgb roughPower(const BoundingSphere& bounds) const override {
    constexpr int kRough = 8, kRoughLines = 256;
    if (fromSphere(bounds))
      return m_radiance * static_cast<float>(etendueOfLines(bounds, kRoughLines));
    const Vec2i count = nodes(bounds);
    return m_radiance * static_cast<float>(
                            etendue(bounds, count.y > 1 ? glm::min(count, Vec2i(kRough)) : count));
  }

  Emission emit(const BoundingSphere& bounds, const Vec4f& u) const override {
    if (fromSphere(bounds)) {
      const Line line = lineThrough(bounds, u);
      const double ahead = line.start ? std::max(0.0, *line.start) : 0.0;
      return {line.origin + line.direction * ahead, Vec3f(line.direction),
              m_radiance * static_cast<float>(line.start ? lines(bounds) : 0.0)};
    }
    const SurfacePoint p = surface({u.x, u.y}, bounds);
    const Departure d = departure(p.position, p.normal, bounds, u.z, u.w);
    return {photonOrigin(p.position, d.direction, bounds), Vec3f(d.direction),
            m_radiance * static_cast<float>(d.weight * p.area)};
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
  /// @param u  in [0, 1)^2
  /// @param bounds  of the smoke, for which a surface may lay out its points
  virtual SurfacePoint surface(const Vec2f& u, const BoundingSphere& bounds) const = 0;
  /// How many points along each side tell the mean power of all. Many lamps ask for it often.
  virtual Vec2i nodes(const BoundingSphere& bounds) const = 0;
  virtual double area() const = 0;  ///< [m^2]
  virtual const Vec3d& center() const = 0;
  virtual double extent() const = 0;     ///< of no point from the centre more [m]
  virtual double halfWidth() const = 0;  ///< where it is narrowest [m]
  /// No point of the surface is nearer to that one [m].
  virtual double nearest(const Vec3d& point) const = 0;
  /// The directions in which it sends light to the sphere, and maybe others.
  virtual Cone headings(const BoundingSphere& bounds) const = 0;
  /// Where the line leaves the lit side of the surface, if it does [m]. Once at most.
  /// @param direction  unit
  virtual std::optional<double> departs(const Vec3d& origin, const Vec3d& direction) const = 0;
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
        sum += p.area * projectedSolidAngle(p.normal, coneToward(p.position, bounds));
      }
    return sum / (count.x * count.y);
  }

  // A line through the sphere.
  struct Line {
    Vec3d origin, direction;      // a radius before the centre; unit
    std::optional<double> start;  // where light from the lamp starts, before it leaves the sphere
  };
  Line lineThrough(const BoundingSphere& bounds, const Vec4f& u) const {
    const Cone cone = headings(bounds);
    const Vec2f disc = sampleDisc({u.x, u.y});
    Line line;
    line.direction = directionInCone(cone.axis, static_cast<double>(u.z) * cone.oneMinusCos, u.w);
    line.origin = discOrigin(line.direction, bounds, disc);
    line.start = departs(line.origin, line.direction);
    const double squared = std::max(0.0, 1 - static_cast<double>(glm::dot(disc, disc)));
    if (line.start && !(*line.start < bounds.radius * (1 + std::sqrt(squared)))) line.start.reset();
    return line;
  }
  // Etendue of all lines through the sphere in those directions [m^2 sr].
  double lines(const BoundingSphere& bounds) const {
    return kPi * bounds.radius * bounds.radius * headings(bounds).solidAngle();
  }
  // Whether a photon from a point of the surface may weigh much more than one along a line, of
  // which enough come from the lamp.
  bool fromSphere(const BoundingSphere& bounds) const {
    constexpr double kMuch = 3, kEnough = 0.25;
    const double most = kMuch * lines(bounds);
    if (kPi * area() <= most) return false;
    const double distance = nearest(bounds.center);
    if (halfWidth() < kEnough * std::max(bounds.radius, distance)) return false;
    const Cone seen = coneToward(Vec3d(distance, 0, 0), {Vec3d(0), bounds.radius});
    return std::min(kPi, seen.solidAngle()) * area() > most;
  }
  // What of the lines comes from the lamp [m^2 sr], by so many; 0 only where none can.
  double etendueOfLines(const BoundingSphere& bounds, int count) const {
    if (isBehind(bounds)) return 0;
    int met = 0;
    for (int i = 1; i <= count; ++i)
      met += lineThrough(bounds, evenPoint(static_cast<std::uint64_t>(i))).start.has_value();
    return lines(bounds) * std::max(1, met) / count;
  }

  Rgb m_radiance;
};

/// A flat lamp that shines to one side.
class FlatLight : public SurfaceLight {
 public:
  /// @param axis  unit, the side it shines to
  /// @param near  within so many extents of its centre a point's sky is filled, not its surface
  FlatLight(const Vec3d& center, const Vec3d& axis, const Rgb& radiance, double near)
      : SurfaceLight(radiance), m_center(center), m_axis(axis), m_near(near) {}

  /// Fills what the lamp takes up of the sky of a near point evenly; from afar, its surface.
  Illumination illuminate(const Vec3f& point, const Vec2f& u) const override {
    const Vec3d from = Vec3d(point) - m_center;
    const double height = glm::dot(from, m_axis);
    if (height > 0 && glm::length(from) < m_near * extent()) {
      const Rectangle around = rectangle(from - height * m_axis);
      const Vec2d foot(glm::dot(from, around.x), glm::dot(from, around.y));
      const SphericalRectangle sky(-0.5 * around.size - foot, 0.5 * around.size - foot, height);
      if (sky.solidAngle() > kLeast) {
        const Vec2d p = sky.sample(u);
        const double distance = std::sqrt(glm::dot(p, p) + height * height);
        const bool shines = covers(around.x * (foot.x + p.x) + around.y * (foot.y + p.y));
        return {Vec3f((height * m_axis - p.x * around.x - p.y * around.y) / distance),
                static_cast<float>(distance),
                shines ? radiance() * static_cast<float>(sky.solidAngle()) : Rgb(0.0f)};
      }
    }
    Vec3d direction;
    Illumination result = PointSource(m_center + offset(u), radiance() * static_cast<float>(area()))
                              .illuminate(point, direction);
    result.irradiance *= static_cast<float>(std::max(0.0, glm::dot(direction, m_axis)));
    return result;
  }

 protected:
  const Vec3d& axis() const { return m_axis; }
  const Vec3d& center() const override { return m_center; }
  // As if the lamp were all of its plane near the point.
  double nearest(const Vec3d& point) const override {
    const Vec3d d = point - m_center;
    return std::max(std::abs(glm::dot(d, m_axis)), glm::length(d) - extent());
  }
  /// From the centre to a point of even density over the surface [m]. @param u  in [0, 1)^2
  virtual Vec3d offset(const Vec2f& u) const = 0;
  /// A rectangle about the centre in the lamp's plane that holds all of it.
  struct Rectangle {
    Vec3d x, y;  ///< unit, along its sides
    Vec2d size;  ///< [m]
  };
  /// @param foot  point of the plane that the lamp is looked at from above, from the centre [m]
  virtual Rectangle rectangle(const Vec3d& foot) const = 0;
  /// Whether a point of that rectangle is of the lamp. @param offset  from the centre [m]
  virtual bool covers(const Vec3d& offset) const = 0;

 private:
  SurfacePoint surface(const Vec2f& u, const BoundingSphere&) const override {
    return {m_center + offset(u), m_axis, area()};
  }

  // The power of a point changes over its distance from the sphere. Of n along a side the mean is
  // off by (extent / distance / n)^2 / 2 of it: 1e-5, where n is not the most.
  Vec2i nodes(const BoundingSphere& bounds) const override {
    constexpr double kFewest = 4.0, kFine = 224.0;
    const double distance = glm::length(m_center - bounds.center) - bounds.radius;
    const double wanted = kFine * extent() / std::max(distance, 1e-300);
    return Vec2i(static_cast<int>(std::ceil(glm::clamp(wanted, kFewest, kSurfaceNodes * 1.0))));
  }
  bool isBehind(const BoundingSphere& bounds) const override {
    return glm::dot(bounds.center - m_center, m_axis) + bounds.radius <= 0;
  }
  Cone headings(const BoundingSphere&) const override { return {m_axis, 1.0}; }
  std::optional<double> departs(const Vec3d& origin, const Vec3d& direction) const override {
    const double toward = glm::dot(direction, m_axis);
    if (!(toward > 0)) return {};
    const Vec3d from = origin - m_center;
    const double distance = -glm::dot(from, m_axis) / toward;
    if (!covers(from + direction * distance)) return {};
    return distance;
  }

  static constexpr double kLeast = 1e-8;  // solid angle that rounding leaves alone [sr]

  Vec3d m_center, m_axis;
  double m_near;
};

/// What `intensity` is of a lamp with a surface.
constexpr Param radianceRow() {
  return intensityRow("W m^-2 sr^-1", "radiance where the color is 1");
}

}  // namespace photosphere::lights
