#pragma once
// Option rows that several lights share, and what they share in reading them.

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
          .help = "of the light's body, for soft shadows",
          .min = 0.0,
          .served = false};
}

/// intensity times color.
inline Rgb scaledColor(const ParamValues& values) {
  return values.rgb("color") * static_cast<float>(values.real("intensity"));
}

inline bool isGreyColor(const Rgb& c) {
  return c.r == c.g && c.g == c.b;
}

/// Unit vector from `position` to `target`. @throws ConfigError when they coincide
Vec3d directionFromValues(const ParamValues& values, std::string_view light);

/// Illumination by a source of `intensity` [W/sr] at `position`: I / d^2. The square grows no more
/// once d falls below the rounding of a float position there (1e-7 of its length, at least 1e-9 m);
/// at the source itself no direction is known and the irradiance is 0.
/// @param[out] direction  the unit propagation direction in double
Illumination illuminateFromPoint(const Vec3d& position, const Rgb& intensity, const Vec3f& point,
                                 Vec3d& direction);

}  // namespace photosphere::lights
