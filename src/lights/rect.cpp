// A rectangle that shines to one side.

#include "area.h"

namespace photosphere::lights::plugins {

namespace {

/// Its first side lies across the axis and the vertical (+Y), its second across both.
class RectLight final : public FlatLight {
 public:
  RectLight(const Vec3d& center, const Vec3d& axis, const Rgb& radiance, const Vec2d& size)
      : FlatLight(center, axis, radiance), m_area(size.x * size.y) {
    const Vec3d up = std::abs(axis.y) < 0.999999 ? Vec3d(0, 1, 0) : Vec3d(0, 0, 1);
    const Vec3d across = glm::normalize(glm::cross(axis, up));
    m_first = across * size.x;
    m_second = glm::cross(across, axis) * size.y;
  }

 private:
  Vec3d offset(const Vec2f& u) const override {
    return m_first * (static_cast<double>(u.x) - 0.5) + m_second * (static_cast<double>(u.y) - 0.5);
  }
  double area() const override { return m_area; }
  double extent() const override { return 0.5 * glm::length(m_first + m_second); }

  Vec3d m_first, m_second;  // its sides [m]
  double m_area;
};

constexpr Param params[] = {
    positionRow("of its centre"),
    targetRow("a point on its axis, on the side it shines to"),
    colorRow(),
    radianceRow(),
    {.name = "size",
     .type = ParamType::vec2,
     .unit = "scene units",
     .defaultText = "[1, 1]",
     .help = "width, which stays level (+Y up), and height",
     .min = 1e-9,
     .max = 1e9},
};

std::unique_ptr<Light> create(const ParamValues& values, const LocalSpace& space) {
  return std::make_unique<RectLight>(space.localFromWorld(values.vec3("position")),
                                     directionFromValues(values, "rect"), scaledColor(values),
                                     values.vec2("size") * space.metersPerUnit);
}

}  // namespace

extern const LightPlugin rect;
const LightPlugin rect = {
    .name = "rect",
    .help = "a rectangle that shines to one side",
    .params = params,
    .create = create,
};

}  // namespace photosphere::lights::plugins
