// A round plate that shines to one side.

#include "area.h"

namespace photosphere::lights::plugins {

namespace {

class DiskLight final : public FlatLight {
 public:
  DiskLight(const Vec3d& center, const Vec3d& axis, const Rgb& radiance, double radius)
      : FlatLight(center, axis, radiance, kNear), m_across(axis), m_radius(radius) {}

 private:
  // Beyond, its parts shine on a point more alike than a square about it is full of it.
  static constexpr double kNear = 2;

  Vec3d offset(const Vec2f& u) const override {
    const Vec2d p = m_radius * Vec2d(sampleDisc(u));
    return m_across.x * p.x + m_across.y * p.y;
  }
  // Turned so that a corner is not nearest, which holds nothing of the lamp.
  Rectangle rectangle(const Vec3d& foot) const override {
    const double length = glm::length(foot);
    const Vec3d x = length > 0 ? foot / length : m_across.x;
    return {x, glm::cross(axis(), x), Vec2d(2 * m_radius)};
  }
  bool covers(const Vec3d& offset) const override {
    return glm::dot(offset, offset) <= m_radius * m_radius;
  }
  double area() const override { return kPi * m_radius * m_radius; }
  double extent() const override { return m_radius; }
  double halfWidth() const override { return m_radius; }

  Across m_across;
  double m_radius;  // [m]
};

constexpr Param params[] = {
    positionRow("of its centre"),
    targetRow("a point on its axis, on the side it shines to"),
    colorRow(),
    radianceRow(),
    bodyRadiusRow(),
};

std::unique_ptr<Light> create(const ParamValues& values, const LocalSpace& space) {
  return std::make_unique<DiskLight>(space.localFromWorld(values.vec3("position")),
                                     directionFromValues(values, "disk"), scaledColor(values),
                                     values.real("radius") * space.metersPerUnit);
}

}  // namespace

extern const LightPlugin disk;
const LightPlugin disk = {
    .name = "disk",
    .help = "a round plate that shines to one side",
    .params = params,
    .create = create,
};

}  // namespace photosphere::lights::plugins
