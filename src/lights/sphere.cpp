// A ball that shines outward.

#include "ball.h"

namespace photosphere::lights::plugins {

namespace {

constexpr Param params[] = {
    positionRow("of its centre"),
    colorRow(),
    radianceRow(),
    bodyRadiusRow(),
};

std::unique_ptr<Light> create(const ParamValues& values, const LocalSpace& space) {
  return std::make_unique<BallLight>(space.localFromWorld(values.vec3("position")),
                                     scaledColor(values),
                                     values.real("radius") * space.metersPerUnit);
}

}  // namespace

extern const LightPlugin sphere;
const LightPlugin sphere = {
    .name = "sphere",
    .help = "a ball that shines outward",
    .params = params,
    .create = create,
};

}  // namespace photosphere::lights::plugins
