#pragma once
// How the light of a spot falls off toward the edge of its cone.

#include <algorithm>

#include "cone.h"
#include "trigonometry.h"

namespace photosphere::lights {

/// The scene contract's falloff: smoothstep(clamp((cone_angle - theta) / cone_edge, 0, 1)), or a
/// hard edge where cone_edge is 0. Only the soft band needs the angle; outside it two comparisons
/// decide.
class Falloff {
 public:
  /// @param angle, edge  [rad]
  Falloff(double angle, double edge)
      : m_angle(angle),
        m_edge(edge),
        m_outer(angle < kPi ? oneMinusCos(angle) : 2.0),
        m_inner(angle > edge ? oneMinusCos(std::min(kPi, angle - edge)) : -1.0) {}

  double angle() const { return m_angle; }
  double fullAngle() const { return std::max(0.0, m_angle - m_edge); }
  double outer() const { return m_outer; }

  /// @param h  1 - cos of the angle to the axis
  double operator()(double h) const {
    if (m_edge <= 0) return h <= m_outer || m_angle >= kPi ? 1.0 : 0.0;
    if (h <= m_inner) return 1.0;
    if (h >= m_outer) return 0.0;
    return soft(angleFromOneMinusCos(h));
  }

 private:
  double soft(double theta) const {
    const double t = glm::clamp((m_angle - theta) / m_edge, 0.0, 1.0);
    return t * t * (3 - 2 * t);
  }

  double m_angle, m_edge;   // [rad]
  double m_outer, m_inner;  // 1 - cos where the light ends and where it is full
};

/// What a spot, or a ball of that radius whose points all shine as one, can bring to a sphere: full
/// where the sphere lies nearest to its axis, dark where its cone misses the sphere.
/// @param intensity  far away, on the axis [W/sr]
inline Reach spotReach(const Vec3d& position, const Vec3d& axis, double intensity,
                       const Falloff& falloff, double radius, const BoundingSphere& bounds) {
  constexpr double slack = 1e-6;  // more than rounding takes from an angle [rad]
  Reach reach = reachFrom(position, radius, intensity, bounds);
  const double between = angleFromOneMinusCos(oneMinusCosBetween(axis, reach.axis));
  const double nearest =
      reach.oneMinusCos >= 2.0 ? 0.0 : between - angleFromOneMinusCos(reach.oneMinusCos) - slack;
  reach.fluence *= falloff(oneMinusCos(std::max(0.0, nearest)));
  if (falloff.outer() < reach.oneMinusCos) {
    reach.axis = axis;
    reach.oneMinusCos = falloff.outer();
  }
  return reach;
}

/// Integral of the falloff over the solid angle that the spot shares with a cone [sr]. Pieces
/// between the angles where the integrand has a kink; t^2 (3 - 2 t) flattens the square roots at
/// their ends.
/// @param nodes  of each piece
double sharedSolidAngle(const Falloff& falloff, const Vec3d& axis, const Cone& cone, int nodes);
/// Nodes for a power, and for one up to a factor near 1, which still is 0 only where that is.
inline constexpr int kFineNodes = 96, kRoughNodes = 8;

}  // namespace photosphere::lights
