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

}  // namespace photosphere::lights
