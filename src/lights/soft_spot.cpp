#include "soft_spot.h"

#include <mutex>
#include <optional>

#include "ball.h"
#include "photosphere/core/sampling.h"

namespace photosphere::lights {

namespace {

/// Parallel light that leaves a ball, as it meets the sphere of the smoke: a disc of lines of the
/// ball's radius, each of which begins on the ball. Its parts follow from the angle between the
/// light and the way to the sphere's centre.
class Beam {
 public:
  /// @param distance  of the two centres [m]
  /// @param angle     [rad]
  Beam(double distance, double angle, double ball, double sphere)
      : m_aside(distance * exactSin(angle)),
        m_ahead(distance * (1 - oneMinusCos(angle))),
        m_ball(ball),
        m_sphere(sphere) {}

  /// Share of the lines that meet the sphere, or begin inside it: the integral over chords of the
  /// disc.
  double share() const {
    const double begin = std::max(-m_ball, m_aside - m_sphere);
    const double end = std::min(m_ball, m_aside + m_sphere);
    if (!(end > begin)) return 0;
    constexpr int nodes = 64;
    double sum = 0;
    for (int i = 0; i < nodes; ++i) {
      // Even in the angle on a circle over the interval, which flattens the chords' ends.
      const double turn = kPi * (i + 0.5) / nodes;
      const double middle = oneMinusCos(turn) / 2;
      sum += chord(begin + (end - begin) * middle) * (end - begin) / 2 * exactSin(turn) * kPi;
    }
    return std::min(1.0, sum / nodes / (kPi * m_ball * m_ball));
  }

 private:
  // Length of the chord at x from the disc's centre toward the sphere's, of lines that meet it.
  // A line at height y ends in the sphere at `ahead + sqrt(sphere^2 - y^2)` and begins on the ball
  // at `sqrt(ball^2 - y^2)`, both at x; which is the farther changes at one height at most.
  double chord(double x) const {
    const double sphere = std::max(0.0, m_sphere * m_sphere - (x - m_aside) * (x - m_aside));
    const double ball = std::max(0.0, m_ball * m_ball - x * x);
    const double top = std::min(sphere, ball);  // squares of heights
    const auto meets = [&](double y) {
      return m_ahead + std::sqrt(sphere - y) > std::sqrt(ball - y);
    };
    const bool low = meets(0), high = meets(top);
    if (low == high) return low ? 2 * std::sqrt(top) : 0.0;
    const double root = (ball - sphere - m_ahead * m_ahead) / (2 * m_ahead);
    const double turning = glm::clamp(sphere - root * root, 0.0, top);
    return 2 * (low ? std::sqrt(turning) : std::sqrt(top) - std::sqrt(turning));
  }

  double m_aside, m_ahead, m_ball, m_sphere;  // [m]
};

class SoftSpot final : public Light {
 public:
  SoftSpot(const Vec3d& center, const Vec3d& axis, const Rgb& intensity, const Falloff& falloff,
           double radius)
      : m_center(center),
        m_axis(axis),
        m_intensity(intensity),
        m_falloff(falloff),
        m_radius(radius) {}

  /// Costs thousands of square roots, and is asked in every pass for the same sphere.
  Rgb power(const BoundingSphere& bounds) const override {
    const std::lock_guard lock(m_mutex);
    if (!m_known || m_known->first.center != bounds.center ||
        m_known->first.radius != bounds.radius)
      m_known.emplace(bounds, integratedPower(bounds));
    return m_known->second;
  }

  /// As if a point sent what the ball does, a part of it past the sphere.
  Rgb roughPower(const BoundingSphere& bounds) const override {
    const double size = bounds.radius + m_radius;
    const bool apart = glm::length(bounds.center - m_center) > size;
    const double part = apart ? bounds.radius / size : std::min(1.0, bounds.radius / m_radius);
    return m_intensity *
           static_cast<float>(part * part *
                              sharedSolidAngle(m_falloff, m_axis, reachOf(bounds), kRoughNodes));
  }

  /// Its solid angle is at most that of a disc at the ball's nearest point.
  Reach reach(const BoundingSphere& bounds) const override {
    const double intensity = maxComponent(Vec3d(m_intensity));
    Reach reach = spotReach(m_center, m_axis, intensity, m_falloff, m_radius, bounds);
    reach.radiance = intensity / (kPi * m_radius * m_radius);
    reach.fluence = std::min(reach.fluence, 2 * kPi * reach.radiance);
    return reach;
  }

  /// A direction from the smaller of the spot's cone and those that can reach the sphere, and a
  /// line from the smaller of the two discs across it.
  Emission emit(const BoundingSphere& bounds, const Vec4f& u) const override {
    const Cone reach = reachOf(bounds);
    const bool fromSpot = m_falloff.outer() < reach.oneMinusCos;
    const Cone cone = fromSpot ? Cone{m_axis, m_falloff.outer()} : reach;
    const double h = static_cast<double>(u.x) * cone.oneMinusCos;
    const Vec3d direction = directionInCone(cone.axis, h, u.y);
    const double falloff = m_falloff(fromSpot ? h : oneMinusCosBetween(direction, m_axis));

    const Vec3d to = bounds.center - m_center;
    const bool ownDisc = m_radius <= bounds.radius;
    const double disc = ownDisc ? m_radius : bounds.radius;
    const Across across(direction);
    const Vec2d point = disc * Vec2d(sampleDisc({u.z, u.w}));
    Vec3d offset = across.x * point.x + across.y * point.y;
    if (!ownDisc) offset += to - direction * glm::dot(to, direction);
    const double depth = m_radius * m_radius - glm::dot(offset, offset);
    const Vec3d origin = m_center + offset + direction * std::sqrt(std::max(0.0, depth));
    const bool meets = depth >= 0 && reaches(bounds, origin, direction);
    const double weight =
        meets ? falloff * cone.solidAngle() * (disc * disc) / (m_radius * m_radius) : 0.0;
    return {photonOrigin(origin, direction, bounds), Vec3f(direction),
            m_intensity * static_cast<float>(weight)};
  }

  /// Fills the smaller of the cone that the ball takes up in the sky of the point and the spot's.
  Illumination illuminate(const Vec3f& point, const Vec2f& u) const override {
    const Vec3d from(point), to = m_center - from;
    if (!(glm::dot(to, to) > m_radius * m_radius)) return {Vec3f(0, 0, 1), 0.0f, Rgb(0.0f)};
    const Cone ball = coneToward(from, {m_center, m_radius});
    const bool fromSpot = m_falloff.outer() < ball.oneMinusCos;
    const Cone cone = fromSpot ? Cone{-m_axis, m_falloff.outer()} : ball;
    const double h = static_cast<double>(u.x) * cone.oneMinusCos;
    const Vec3d toLamp = directionInCone(cone.axis, h, u.y);
    double weight = m_falloff(fromSpot ? h : oneMinusCosBetween(-toLamp, m_axis));
    if (fromSpot && oneMinusCosBetween(toLamp, ball.axis) > ball.oneMinusCos) weight = 0;
    Illumination result;
    result.direction = Vec3f(-toLamp);
    result.distance = static_cast<float>(distanceToBall(to, toLamp, m_radius));
    result.irradiance =
        ballRadiance(m_intensity, m_radius) * static_cast<float>(weight * cone.solidAngle());
    return result;
  }

  bool isDelta() const override { return false; }
  std::optional<Place> place() const override { return Place{m_center, m_radius}; }
  bool isGrey() const override { return isGreyColor(m_intensity); }

 private:
  // Directions in which lines from the ball can meet the sphere.
  Cone reachOf(const BoundingSphere& bounds) const {
    Cone cone = coneToward(m_center, {bounds.center, bounds.radius + m_radius});
    const Vec3d to = bounds.center - m_center;
    const double distance = glm::length(to);
    cone.axis = distance > 0 ? to / distance : m_axis;
    return cone;
  }

  // Integral of the falloff within an angle of an axis [sr].
  double shared(const Vec3d& axis, double angle) const {
    constexpr int nodes = 32;  // a hundred of these integrals make a power
    return sharedSolidAngle(m_falloff, m_axis, {axis, oneMinusCos(angle)}, nodes);
  }

  static bool reaches(const BoundingSphere& bounds, const Vec3d& origin, const Vec3d& direction) {
    const Chord chord(bounds.center - origin, direction, bounds.radius);
    return chord.halfSquared > 0 && chord.middle + std::sqrt(chord.halfSquared) > 0;
  }

  // Over directions: the spot's intensity times the share of its lines that meet the sphere.
  Rgb integratedPower(const BoundingSphere& bounds) const {
    const Cone reach = reachOf(bounds);
    const double distance = glm::length(bounds.center - m_center);
    // Within the sphere all lines begin in it.
    if (distance + m_radius <= bounds.radius)
      return m_intensity * static_cast<float>(shared(reach.axis, kPi));
    const auto share = [&](double angle) {
      return Beam(distance, angle, m_radius, bounds.radius).share();
    };
    // Up to the first angle the share is constant: the smaller of the two discs lies in the other.
    const bool apart = distance > bounds.radius + m_radius;
    const double first = apart ? exactAsin(std::abs(bounds.radius - m_radius) / distance) : 0.0;
    // From there on, where the spot has light.
    const double between = angleFromOneMinusCos(oneMinusCosBetween(m_axis, reach.axis));
    const double begin = std::max(first, between - m_falloff.angle());
    const double end =
        std::min(angleFromOneMinusCos(reach.oneMinusCos), between + m_falloff.angle());
    double before = shared(reach.axis, first);
    double sum = share(first / 2) * before;
    constexpr int steps = 96;
    for (int i = 0; i < steps && end > begin; ++i) {
      const double now = shared(reach.axis, begin + (end - begin) * (i + 1) / steps);
      sum += share(begin + (end - begin) * (i + 0.5) / steps) * (now - before);
      before = now;
    }
    return m_intensity * static_cast<float>(sum);
  }

  mutable std::mutex m_mutex;
  mutable std::optional<std::pair<BoundingSphere, Rgb>> m_known;  // power toward the last sphere
  Vec3d m_center, m_axis;
  Rgb m_intensity;  // far away, on the axis [W/sr]
  Falloff m_falloff;
  double m_radius;  // [m]
};

}  // namespace

std::unique_ptr<Light> makeSoftSpot(const Vec3d& position, const Vec3d& axis, const Rgb& intensity,
                                    const Falloff& falloff, double radius) {
  return std::make_unique<SoftSpot>(position, axis, intensity, falloff, radius);
}

}  // namespace photosphere::lights
