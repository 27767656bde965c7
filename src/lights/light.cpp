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

Illumination illuminateFromPoint(const Vec3d& position, const Rgb& intensity, const Vec3f& point,
                                 Vec3d& direction) {
  const Vec3d d = Vec3d(point) - position;
  const double distance = glm::length(d);
  direction = distance > 0 ? d / distance : Vec3d(0, 0, 1);
  Illumination result;
  result.direction = Vec3f(direction);
  result.distance = static_cast<float>(distance);
  if (distance > 0) {
    const double clamped = glm::max(distance, glm::max(1e-9, 1e-7 * glm::length(position)));
    result.irradiance = intensity * static_cast<float>(1 / (clamped * clamped));
  }
  return result;
}

}  // namespace photosphere::lights
