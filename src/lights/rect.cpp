// A rectangle that shines to one side.

#include "area.h"

namespace photosphere::lights::plugins {

namespace {

/// Its first side lies across the axis and the vertical (+Y), its second across both.
class RectLight final : public FlatLight {
 public:
  RectLight(const Vec3d& center, const Vec3d& axis, const Rgb& radiance, const Vec2d& size)
      : FlatLight(center, axis, radiance, kNear), m_size(size) {
    const Vec3d up = std::abs(axis.y) < 0.999999 ? Vec3d(0, 1, 0) : Vec3d(0, 0, 1);
    m_x = glm::normalize(glm::cross(axis, up));
    m_y = glm::cross(m_x, axis);
  }

 private:
  // Beyond, its parts shine on a point nearly alike.
  static constexpr double kNear = 4;

  Vec3d offset(const Vec2f& u) const override {
    const Vec2d p = m_size * (Vec2d(u) - 0.5);
    return m_x * p.x + m_y * p.y;
  }
  /// Of a side that is long beside the smoke and the way there the points gather near the smoke: by
  /// even angles, as they are seen from that far away.
  SurfacePoint surface(const Vec2f& u, const BoundingSphere& bounds) const override {
    const double away = std::max(bounds.radius, nearest(bounds.center));
    const Vec3d foot = bounds.center - center();
    const Along x = along(u.x, m_size.x, glm::dot(foot, m_x), away);
    const Along y = along(u.y, m_size.y, glm::dot(foot, m_y), away);
    return {center() + m_x * x.at + m_y * y.at, axis(), x.length * y.length};
  }
  /// A point of a side, and the side's length were it as dense everywhere.
  struct Along {
    double at, length;  // from the middle [m]; [m]
  };
  static Along along(float u, double size, double foot, double away) {
    constexpr double kLong = 16;
    if (size < kLong * away) return {size * (static_cast<double>(u) - 0.5), size};
    const auto angle = [&](double x) {
      return std::copysign(exactAsin(std::abs(x) / std::sqrt(x * x + away * away)), x);
    };
    const double low = angle(-0.5 * size - foot), high = angle(0.5 * size - foot);
    const double turned = low + static_cast<double>(u) * (high - low);
    const double sine = exactSin(std::abs(turned));
    const double tangent = sine / std::sqrt(std::max(1e-300, (1 - sine) * (1 + sine)));
    const double x = std::copysign(std::min(away * tangent, 2 * size), turned);
    return {glm::clamp(foot + x, -0.5 * size, 0.5 * size),
            (high - low) * (x * x + away * away) / away};
  }
  Rectangle rectangle(const Vec3d&) const override { return {m_x, m_y, m_size}; }
  bool covers(const Vec3d& offset) const override {
    return std::abs(glm::dot(offset, m_x)) <= 0.5 * m_size.x &&
           std::abs(glm::dot(offset, m_y)) <= 0.5 * m_size.y;
  }
  double area() const override { return m_size.x * m_size.y; }
  double extent() const override { return 0.5 * glm::length(m_size); }
  double halfWidth() const override { return 0.5 * std::min(m_size.x, m_size.y); }

  Vec3d m_x, m_y;  // unit, along its sides
  Vec2d m_size;    // [m]
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
