// Shines alike into all directions, from one point or from a ball.

#include "ball.h"

namespace photosphere::lights::plugins {

namespace {

class PointLight final : public Light {
 public:
  PointLight(const Vec3d& position, const Rgb& intensity) : m_source(position, intensity) {}

  Rgb power(const BoundingSphere& bounds) const override {
    return m_source.intensity() *
           static_cast<float>(coneToward(m_source.position(), bounds).solidAngle());
  }

  Reach reach(const BoundingSphere& bounds) const override {
    return reachFrom(m_source.position(), 0.0, maxComponent(Vec3d(m_source.intensity())), bounds);
  }

  Emission emit(const BoundingSphere& bounds, const Vec4f& u) const override {
    const Cone cone = coneToward(m_source.position(), bounds);
    const Vec3d direction =
        directionInCone(cone.axis, static_cast<double>(u.x) * cone.oneMinusCos, u.y);
    return {photonOrigin(m_source.position(), direction, bounds), Vec3f(direction),
            m_source.intensity() * static_cast<float>(cone.solidAngle())};
  }

  Illumination illuminate(const Vec3f& point, const Vec2f&) const override {
    return m_source.illuminate(point);
  }

  bool isDelta() const override { return true; }
  std::optional<Place> place() const override { return Place{m_source.position(), 0.0}; }
  bool isGrey() const override { return isGreyColor(m_source.intensity()); }

 private:
  PointSource m_source;
};

constexpr Param params[] = {
    positionRow("of the light"),
    colorRow(),
    intensityRow("W/sr", "in every direction"),
    softRadiusRow(),
};

std::unique_ptr<Light> create(const ParamValues& values, const LocalSpace& space) {
  const Vec3d position = space.localFromWorld(values.vec3("position"));
  const double radius = values.real("radius") * space.metersPerUnit;
  if (radius > roundingAt(position))
    return std::make_unique<BallLight>(position, ballRadiance(scaledColor(values), radius), radius);
  return std::make_unique<PointLight>(position, scaledColor(values));
}

}  // namespace

extern const LightPlugin point;
const LightPlugin point = {
    .name = "point",
    .help = "a point that shines alike into all directions",
    .params = params,
    .create = create,
};

}  // namespace photosphere::lights::plugins
