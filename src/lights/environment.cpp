// Surroundings of one radiance, or of a picture.

#include <fmt/format.h>

#include "cone.h"
#include "environment_map.h"
#include "photosphere/core/error.h"
#include "photosphere/core/sampling.h"
#include "photosphere/image/load.h"
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

  Reach reach(const BoundingSphere&) const override {
    const double radiance = maxComponent(Vec3d(m_radiance));
    return {.fluence = 4 * kPi * radiance, .radiance = radiance, .background = radiance};
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
  bool isUniform() const override { return true; }
  bool isGrey() const override { return isGreyColor(m_radiance); }

 private:
  Rgb m_radiance;  // [W m^-2 sr^-1]
};

/// Directions in proportion to the light that comes from there.
class MappedLight final : public Light {
 public:
  explicit MappedLight(EnvironmentMap map) : m_map(std::move(map)) {}

  Rgb power(const BoundingSphere& bounds) const override {
    return m_map.integral() * crossSection(bounds);
  }

  Reach reach(const BoundingSphere&) const override {
    return {.fluence = m_map.mostFluence(),
            .radiance = m_map.mostRadiance(),
            .background = m_map.mostRadiance()};
  }

  Emission emit(const BoundingSphere& bounds, const Vec4f& u) const override {
    const EnvironmentMap::Sample s = m_map.sample({u.x, u.y});
    if (!(s.density > 0.0f)) return {bounds.center, Vec3f(0, 0, 1), Rgb(0.0f)};
    const Vec3f direction = -s.toward;
    const Vec3d axis = glm::normalize(Vec3d(direction));
    return {discOrigin(axis, bounds, sampleDisc({u.z, u.w})), direction,
            s.radiance * (crossSection(bounds) / s.density)};
  }

  Illumination illuminate(const Vec3f&, const Vec2f& u) const override {
    const EnvironmentMap::Sample s = m_map.sample(u);
    if (!(s.density > 0.0f)) return {Vec3f(0, 0, 1), kInfinity, Rgb(0.0f)};
    return {-s.toward, kInfinity, s.radiance / s.density};
  }

  Rgb background(const Vec3f& direction) const override { return m_map.radiance(direction); }
  bool isDelta() const override { return false; }
  bool isGrey() const override { return m_map.isGrey(); }
  void addContent(Hasher& hasher) const override { m_map.addContent(hasher); }
  std::optional<InvalidContent> invalidContent() const override {
    const InvalidPixels& found = m_map.invalid();
    if (found.total() == 0) return {};
    return InvalidContent{found.text(), found.nans + found.infinities == 0};
  }

 private:
  static float crossSection(const BoundingSphere& bounds) {
    return static_cast<float>(kPi * bounds.radius * bounds.radius);
  }

  EnvironmentMap m_map;
};

constexpr std::size_t kMostPixels = std::size_t{1} << 26;

std::unique_ptr<Light> fromFile(const std::string& path, const Rgb& scale) {
  image::LoadedImage loaded = image::loadImage(path);
  const image::Window& whole = loaded.image.displayWindow();
  const auto pixels =
      static_cast<std::size_t>(whole.width) * static_cast<std::size_t>(whole.height);
  if (std::max(pixels, loaded.image.pixelCount()) > kMostPixels)
    throw ConfigError(
        fmt::format("{}: {} x {} pixels are more than the 8192 x 8192 that an "
                    "environment may have; scale it down",
                    path, whole.width, whole.height));
  if (loaded.colorSpace == "sRGB")
    throw ConfigError(
        fmt::format("{}: holds values for a display (sRGB), not light; use an EXR or "
                    "HDR file with linear values in the rendering space",
                    path));
  return std::make_unique<MappedLight>(EnvironmentMap(loaded.image, scale));
}

constexpr Param params[] = {
    colorRow(),
    intensityRow("W m^-2 sr^-1", "radiance where the color, or the picture, is 1"),
    {.name = "file",
     .type = ParamType::text,
     .unit = "",
     .defaultText = "",
     .help = "latitude-longitude picture with linear values (EXR, HDR), +Y up, +Z in its middle; "
             "empty = the constant color"},
};

std::unique_ptr<Light> create(const ParamValues& values, const LocalSpace&) {
  if (const std::string& file = values.text("file"); !file.empty())
    return fromFile(file, scaledColor(values));
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
