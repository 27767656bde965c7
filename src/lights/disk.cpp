// A round plate that shines to one side.

#include "area.h"
#include "photosphere/core/sampling.h"

namespace photosphere::lights::plugins {

namespace {

class DiskLight final : public FlatLight {
 public:
  DiskLight(const Vec3d& center, const Vec3d& axis, const Rgb& radiance, double radius)
      : FlatLight(center, axis, radiance), m_across(axis), m_radius(radius) {}

 private:
  Vec3d offset(const Vec2f& u) const override {
    const Vec2d p = m_radius * Vec2d(sampleDisc(u));
    return m_across.x * p.x + m_across.y * p.y;
  }
  double area() const override { return kPi * m_radius * m_radius; }
  double extent() const override { return m_radius; }

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
