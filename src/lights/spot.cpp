// Shines from one point into a cone with a hard or soft edge.

#include <algorithm>
#include <array>

#include "cone.h"
#include "rows.h"
#include "trigonometry.h"

namespace photosphere::lights::plugins {

namespace {

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

/// The part of a circle at angle theta about one axis that lies in a cone about another axis.
/// All angles as 1 - cos. Spherical law of cosines, written so that small angles do not cancel.
double fractionInside(double theta, double between, double cone) {
  const double numerator = between + theta - between * theta - cone;
  const double squared = between * (2 - between) * theta * (2 - theta);
  if (squared <= 0) return numerator <= 0 ? 1.0 : 0.0;
  return exactAcos(numerator / std::sqrt(squared)) / kPi;
}

/// Integral of the falloff over the solid angle that the spot shares with a cone [sr]. Pieces
/// between the angles where the integrand has a kink; t^2 (3 - 2 t) flattens the square roots at
/// their ends.
double sharedSolidAngle(const Falloff& falloff, const Vec3d& axis, const Cone& cone) {
  const double between = oneMinusCosBetween(axis, cone.axis);
  const double gamma = angleFromOneMinusCos(between);
  const double beta = angleFromOneMinusCos(cone.oneMinusCos);
  const bool whole = cone.oneMinusCos >= 2.0;
  const double end = std::min(kPi, falloff.angle());
  std::array<double, 6> ends{0.0,          falloff.fullAngle(),    std::abs(gamma - beta),
                             gamma + beta, 2 * kPi - gamma - beta, end};
  for (double& angle : ends)
    angle = std::clamp(angle, 0.0, end);
  std::sort(ends.begin(), ends.end());
  constexpr int nodes = 96;
  double sum = 0;
  for (std::size_t piece = 0; piece + 1 < ends.size(); ++piece) {
    const double width = ends[piece + 1] - ends[piece];
    if (width <= 0) continue;
    for (int i = 0; i < nodes; ++i) {
      const double t = (i + 0.5) / nodes;
      const double theta = ends[piece] + width * t * t * t * (10 + t * (6 * t - 15));
      const double h = oneMinusCos(theta);
      const double inside = whole ? 1.0 : fractionInside(h, between, cone.oneMinusCos);
      if (inside <= 0) continue;
      const double sine = std::sqrt(std::max(0.0, h * (2 - h)));
      const double slope = 30 * t * t * (1 - t) * (1 - t);
      sum += falloff(h) * inside * 2 * kPi * sine * width * slope / nodes;
    }
  }
  return sum;
}

// More than rounding takes from an angle [rad].
constexpr double kAngleSlack = 1e-6;

class SpotLight final : public Light {
 public:
  SpotLight(const Vec3d& position, const Vec3d& axis, const Rgb& intensity, const Falloff& falloff)
      : m_source(position, intensity), m_axis(axis), m_falloff(falloff) {}

  Rgb power(const BoundingSphere& bounds) const override {
    return m_source.intensity() * static_cast<float>(sharedSolidAngle(
                                      m_falloff, m_axis, coneToward(m_source.position(), bounds)));
  }

  /// Full on the part of the spot's cone that lies nearest to its axis, dark where that misses.
  Reach reach(const BoundingSphere& bounds) const override {
    Reach reach =
        reachFrom(m_source.position(), 0.0, maxComponent(Vec3d(m_source.intensity())), bounds);
    const double between = angleFromOneMinusCos(oneMinusCosBetween(m_axis, reach.axis));
    const double nearest = reach.oneMinusCos >= 2.0
                               ? 0.0
                               : between - angleFromOneMinusCos(reach.oneMinusCos) - kAngleSlack;
    reach.fluence *= m_falloff(oneMinusCos(std::max(0.0, nearest)));
    if (m_falloff.outer() < reach.oneMinusCos) {
      reach.axis = m_axis;
      reach.oneMinusCos = m_falloff.outer();
    }
    return reach;
  }

  /// Draws from the smaller of the spot's cone and the sphere's; what falls outside the other has
  /// no power.
  Emission emit(const BoundingSphere& bounds, const Vec4f& u) const override {
    const Cone toSmoke = coneToward(m_source.position(), bounds);
    const bool fromSpot = m_falloff.outer() < toSmoke.oneMinusCos;
    const Cone cone = fromSpot ? Cone{m_axis, m_falloff.outer()} : toSmoke;
    const double h = static_cast<double>(u.x) * cone.oneMinusCos;
    const Vec3d direction = directionInCone(cone.axis, h, u.y);
    double weight = m_falloff(fromSpot ? h : oneMinusCosBetween(direction, m_axis));
    if (fromSpot && oneMinusCosBetween(direction, toSmoke.axis) > toSmoke.oneMinusCos &&
        toSmoke.oneMinusCos < 2.0)
      weight = 0;
    return {photonOrigin(m_source.position(), direction, bounds), Vec3f(direction),
            m_source.intensity() * static_cast<float>(weight * cone.solidAngle())};
  }

  Illumination illuminate(const Vec3f& point, const Vec2f&) const override {
    Vec3d direction;
    Illumination result = m_source.illuminate(point, direction);
    result.irradiance *= static_cast<float>(m_falloff(oneMinusCosBetween(direction, m_axis)));
    return result;
  }

  bool isDelta() const override { return true; }
  bool isGrey() const override { return isGreyColor(m_source.intensity()); }

 private:
  PointSource m_source;  // intensity on the axis
  Vec3d m_axis;          // unit, along propagation
  Falloff m_falloff;
};

constexpr Param params[] = {
    positionRow("of the light"),
    targetRow("a point on the axis of the cone"),
    colorRow(),
    intensityRow("W/sr", "on the axis"),
    {.name = "cone_angle",
     .type = ParamType::real,
     .unit = "degrees",
     .defaultText = "20.0",
     .help = "half-angle of the cone, from its axis to where the light ends",
     .min = 1e-4,
     .max = 180.0},
    {.name = "cone_edge",
     .type = ParamType::real,
     .unit = "degrees",
     .defaultText = "0.0",
     .help = "width of the soft edge, measured inward from cone_angle; 0 = hard edge",
     .min = 0.0,
     .max = 180.0},
    softRadiusRow(),
};

std::unique_ptr<Light> create(const ParamValues& values, const LocalSpace& space) {
  const double radians = kPi / 180;
  const Falloff falloff(values.real("cone_angle") * radians, values.real("cone_edge") * radians);
  return std::make_unique<SpotLight>(space.localFromWorld(values.vec3("position")),
                                     directionFromValues(values, "spot"), scaledColor(values),
                                     falloff);
}

}  // namespace

extern const LightPlugin spot;
const LightPlugin spot = {
    .name = "spot",
    .help = "a point that shines into a cone",
    .params = params,
    .create = create,
};

}  // namespace photosphere::lights::plugins
