// Surroundings of one radiance.

#include "cone.h"
#include "photosphere/core/sampling.h"
#include "rows.h"

namespace photosphere::lights::plugins {

namespace {

class EnvironmentLight final : public Light {
 public:
  explicit EnvironmentLight(const Rgb& radiance) : m_radiance(radiance) {}

  /// Each direction sends its radiance through the sphere's cross-section: 4 pi times pi R^2.
  Rgb power(const BoundingSphere& bounds) const override {
    return m_radiance * static_cast<float>(4 * kPi * kPi * bounds.radius * bounds.radius);
  }

  Emission emit(const BoundingSphere& bounds, const Vec4f& u) const override {
    const Vec3f direction = sampleSphere({u.x, u.y});
    const Vec3d axis = glm::normalize(Vec3d(direction));
    return {discOrigin(axis, bounds, sampleDisc({u.z, u.w})), direction, power(bounds)};
  }

  Illumination illuminate(const Vec3f&, const Vec2f& u) const override {
    return {-sampleSphere(u), kInfinity, m_radiance * static_cast<float>(4 * kPi)};
  }

  Rgb background(const Vec3f&) const override { return m_radiance; }
  bool isDelta() const override { return false; }
  bool surrounds() const override { return true; }
  bool isGrey() const override { return isGreyColor(m_radiance); }

 private:
  Rgb m_radiance;  // [W m^-2 sr^-1]
};

constexpr Param params[] = {
    colorRow(),
    intensityRow("W m^-2 sr^-1", "radiance where the color is 1"),
    {.name = "file",
     .type = ParamType::text,
     .unit = "",
     .defaultText = "",
     .help = "latitude-longitude image, +Y up; empty = the constant color",
     .served = false},
};

std::unique_ptr<Light> create(const ParamValues& values, const LocalSpace&) {
  return std::make_unique<EnvironmentLight>(scaledColor(values));
}

}  // namespace

extern const LightPlugin environment;
const LightPlugin environment = {
    .name = "environment",
    .help = "surroundings that shine from everywhere",
    .params = params,
    .create = create,
};

}  // namespace photosphere::lights::plugins
