#include "photosphere/lights/light.h"

#include <fmt/format.h>

#include <cmath>

#include "photosphere/core/error.h"
#include "rows.h"

namespace photosphere::lights {

std::span<const Param> lightParams() {
  static constexpr Param params[] = {
      {.name = "name",
       .type = ParamType::text,
       .unit = "",
       .defaultText = "key",
       .help = "light group for AOVs"},
  };
  return params;
}

Rgb scaledColor(const ParamValues& values) {
  const Rgb scaled = values.rgb("color") * static_cast<float>(values.real("intensity"));
  if (!std::isfinite(Vec3d(scaled).x + Vec3d(scaled).y + Vec3d(scaled).z))
    throw ConfigError(
        fmt::format("'intensity' = {:.3g} times 'color' is more than a float holds; lower the "
                    "intensity",
                    values.real("intensity")));
  return scaled;
}

Vec3d directionFromValues(const ParamValues& values, std::string_view light) {
  const Vec3d d = values.vec3("target") - values.vec3("position");
  const double length = glm::length(d);
  if (!(length > 0) || !std::isfinite(length))
    throw ConfigError(
        fmt::format("{} light: `position` and `target` must be two finite, different points, as "
                    "the light shines "
                    "from one to the other",
                    light));
  return d / length;
}

}  // namespace photosphere::lights
