// Parallel light, as from the sun.

#include "cone.h"
#include "photosphere/core/sampling.h"
#include "rows.h"

namespace photosphere::lights::plugins {

namespace {

class DirectionalLight final : public Light {
 public:
  DirectionalLight(const Vec3d& direction, const Rgb& irradiance)
      : m_direction(direction), m_irradiance(irradiance) {}

  Rgb power(const BoundingSphere& bounds) const override {
    return m_irradiance * static_cast<float>(kPi * bounds.radius * bounds.radius);
  }

  Reach reach(const BoundingSphere&) const override {
    return {.fluence = maxComponent(Vec3d(m_irradiance)),
            .background = 0.0,
            .axis = m_direction,
            .oneMinusCos = 0.0};
  }

  Emission emit(const BoundingSphere& bounds, const Vec4f& u) const override {
    return {discOrigin(m_direction, bounds, sampleDisc({u.x, u.y})), Vec3f(m_direction),
            power(bounds)};
  }

  Illumination illuminate(const Vec3f&, const Vec2f&) const override {
    return {Vec3f(m_direction), kInfinity, m_irradiance};
  }

  bool isDelta() const override { return true; }
  bool isGrey() const override { return isGreyColor(m_irradiance); }

 private:
  Vec3d m_direction;  // unit, along propagation
  Rgb m_irradiance;   // at normal incidence [W/m^2]
};

constexpr Param params[] = {
    positionRow("with `target` gives the direction of the light; the place itself does not matter"),
    targetRow("the light shines from `position` toward it"),
    colorRow(),
    intensityRow("W/m^2", "irradiance at normal incidence"),
};

std::unique_ptr<Light> create(const ParamValues& values, const LocalSpace&) {
  return std::make_unique<DirectionalLight>(directionFromValues(values, "directional"),
                                            scaledColor(values));
}

}  // namespace

extern const LightPlugin directional;
const LightPlugin directional = {
    .name = "directional",
    .help = "parallel light from infinitely far away",
    .params = params,
    .create = create,
};

}  // namespace photosphere::lights::plugins
