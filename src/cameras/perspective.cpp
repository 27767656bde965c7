// The pinhole camera.

#include <cmath>

#include "photosphere/core/error.h"
#include "placed_camera.h"

namespace photosphere::cameras::plugins {

namespace {

class Perspective final : public PlacedCamera {
 public:
  Perspective(const Mat4d& worldFromCamera, const Vec2i& resolution, double tanHalf, double near)
      : PlacedCamera(worldFromCamera, resolution, tanHalf), m_near(near) {}

  CameraRay ray(const Vec2d& raster) const override {
    const Vec2d w = window(raster);
    const Vec3d toPlane = right() * w.x + up() * w.y - back();
    // `near` is a plane: rays at the side of the frame begin farther from the eye.
    return {position() + toPlane * m_near, glm::normalize(toPlane)};
  }

  bool hasEye() const override { return true; }

  std::optional<Mat4d> ndcFromWorld() const override {
    // ndc = (1/2 + x / (2 halfX depth), 1/2 - y / (2 halfY depth)), w = depth.
    Mat4d ndc(0.0);
    ndc[0][0] = 0.5 / halfWindow().x;
    ndc[1][1] = -0.5 / halfWindow().y;
    ndc[2] = glm::dvec4(0.5, 0.5, 1, 1);
    return ndc * cameraFromWorld();
  }

 private:
  double m_near;  // [scene units]
};

constexpr Param params[] = {
    {.name = "fov",
     .type = ParamType::real,
     .unit = "degrees",
     .defaultText = "30.0",
     .help = "horizontal field of view",
     .min = 1e-3,
     .max = 179},
    {.name = "focal_length",
     .type = ParamType::real,
     .unit = "mm",
     .defaultText = "50.0",
     .help = "with horizontal_aperture, in place of fov",
     .min = 1e-3},
    {.name = "horizontal_aperture",
     .type = ParamType::real,
     .unit = "mm",
     .defaultText = "36.0",
     .help = "width of the film, with focal_length",
     .min = 1e-3},
    nearRow(),
};

std::unique_ptr<Camera> create(const ParamValues& values, const Mat4d& worldFromCamera,
                               const Vec2i& resolution) {
  const bool byLens = values.given("focal_length") || values.given("horizontal_aperture");
  if (byLens && values.given("fov"))
    throw ConfigError(
        "`fov` and `focal_length` with `horizontal_aperture` both say how wide the view "
        "is; "
        "give one of them");
  const double tanHalf = byLens
                             ? values.real("horizontal_aperture") / 2 / values.real("focal_length")
                             : std::tan(values.real("fov") * kPi / 360);
  return std::make_unique<Perspective>(worldFromCamera, resolution, tanHalf, values.real("near"));
}

}  // namespace

extern const CameraPlugin perspective;
const CameraPlugin perspective = {
    .name = "perspective",
    .help = "pinhole with a field of view or a lens in millimetres",
    .params = params,
    .create = create,
};

}  // namespace photosphere::cameras::plugins
