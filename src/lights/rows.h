#pragma once
// Option rows that several lights share, and what they share in reading them.

#include <cmath>

#include "photosphere/lights/light.h"

namespace photosphere::lights {

constexpr Param positionRow(std::string_view help) {
  return {.name = "position",
          .type = ParamType::vec3,
          .unit = "scene units",
          .defaultText = "[3, 2.5, 1]",
          .help = help};
}

constexpr Param targetRow(std::string_view help) {
  return {.name = "target",
          .type = ParamType::vec3,
          .unit = "scene units",
          .defaultText = "[0, 0, 0]",
          .help = help};
}

constexpr Param colorRow() {
  return {.name = "color",
          .type = ParamType::rgb,
          .unit = "",
          .defaultText = "[1, 1, 1]",
          .help = "linear, in the rendering space; multiplies the intensity",
          .min = 0.0};
}

constexpr Param intensityRow(std::string_view unit, std::string_view help) {
  return {.name = "intensity",
          .type = ParamType::real,
          .unit = unit,
          .defaultText = "1.0",
          .help = help,
          .min = 0.0};
}

constexpr Param softRadiusRow() {
  return {.name = "radius",
          .type = ParamType::real,
          .unit = "scene units",
          .defaultText = "0.0",
          .help =
              "of the ball that it shines from, with the same intensity, for soft shadows; "
              "dark inside; 0 = a point",
          .min = 0.0,
          .max = 1e9};
}

constexpr Param bodyRadiusRow() {
  return {.name = "radius",
          .type = ParamType::real,
          .unit = "scene units",
          .defaultText = "0.5",
          .help = "of the light's body",
          .min = 1e-9,
          .max = 1e9};
}

/// intensity times color. @throws ConfigError when that is more than a float holds
Rgb scaledColor(const ParamValues& values);

inline bool isGreyColor(const Rgb& c) {
  return c.r == c.g && c.g == c.b;
}

/// Unit vector from `position` to `target`. @throws ConfigError when they coincide
Vec3d directionFromValues(const ParamValues& values, std::string_view light);

/// The rounding of a float position there, which is nowhere below a nanometre [m].
/// @param position  local space [m]
inline double roundingAt(const Vec3d& position) {
  return glm::max(1e-9, 1e-7 * glm::length(position));
}

/// A source of light at one point, ready to be asked often.
class PointSource {
 public:
  /// @param position   local space [m]
  /// @param intensity  [W/sr]
  PointSource(const Vec3d& position, const Rgb& intensity)
      : m_position(position), m_intensity(intensity), m_largestInverse(1 / roundingAt(position)) {}

  const Vec3d& position() const { return m_position; }
  const Rgb& intensity() const { return m_intensity; }

  /// I / d^2. The square grows no more once d falls below the rounding of a float position there
  /// (1e-7 of its length, at least 1e-9 m); at the source itself no direction is known and the
  /// irradiance is 0.
  Illumination illuminate(const Vec3f& point) const {
    // The difference in double, where it cancels; its length in float, where that has no digits to
    // lose.
    const Vec3f d(Vec3d(point) - m_position);
    const float squared = glm::dot(d, d);
    if (!(squared > 1e-30f && squared < 1e30f)) {
      Vec3d direction;
      return illuminate(point, direction);
    }
    const float inverse = 1.0f / std::sqrt(squared);
    const float clamped = glm::min(inverse, static_cast<float>(m_largestInverse));
    return {d * inverse, squared * inverse, m_intensity * (clamped * clamped)};
  }
  /// The same, and the unit propagation direction in double.
  Illumination illuminate(const Vec3f& point, Vec3d& direction) const {
    const Vec3d d = Vec3d(point) - m_position;
    const double squared = glm::dot(d, d);
    Illumination result;
    if (!(squared > 0)) {
      direction = Vec3d(0, 0, 1);
      result.direction = Vec3f(direction);
      result.distance = 0.0f;
      return result;
    }
    const double inverse = 1 / std::sqrt(squared);
    direction = d * inverse;
    result.direction = Vec3f(direction);
    result.distance = static_cast<float>(squared * inverse);
    const double clamped = glm::min(inverse, m_largestInverse);
    result.irradiance = m_intensity * static_cast<float>(clamped * clamped);
    return result;
  }

 private:
  Vec3d m_position;
  Rgb m_intensity;
  double m_largestInverse;  // of the distance, where I / d^2 stops growing [1/m]
};

}  // namespace photosphere::lights
