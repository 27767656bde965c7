// Shines into a cone with a hard or soft edge, from one point or from a ball.

#include "falloff.h"
#include "rows.h"
#include "soft_spot.h"

namespace photosphere::lights::plugins {

namespace {

class SpotLight final : public Light {
 public:
  SpotLight(const Vec3d& position, const Vec3d& axis, const Rgb& intensity, const Falloff& falloff)
      : m_source(position, intensity), m_axis(axis), m_falloff(falloff) {}

  Rgb power(const BoundingSphere& bounds) const override { return powerBy(bounds, kFineNodes); }
  Rgb roughPower(const BoundingSphere& bounds) const override {
    return powerBy(bounds, kRoughNodes);
  }

  Reach reach(const BoundingSphere& bounds) const override {
    return spotReach(m_source.position(), m_axis, maxComponent(Vec3d(m_source.intensity())),
                     m_falloff, 0.0, bounds);
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
  std::optional<Place> place() const override { return Place{m_source.position(), 0.0}; }
  bool isGrey() const override { return isGreyColor(m_source.intensity()); }

 private:
  Rgb powerBy(const BoundingSphere& bounds, int nodes) const {
    const Cone cone = coneToward(m_source.position(), bounds);
    return m_source.intensity() *
           static_cast<float>(sharedSolidAngle(m_falloff, m_axis, cone, nodes));
  }

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
  const Vec3d position = space.localFromWorld(values.vec3("position"));
  const Vec3d axis = directionFromValues(values, "spot");
  const double radius = values.real("radius") * space.metersPerUnit;
  if (radius > roundingAt(position))
    return makeSoftSpot(position, axis, scaledColor(values), falloff, radius);
  return std::make_unique<SpotLight>(position, axis, scaledColor(values), falloff);
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
