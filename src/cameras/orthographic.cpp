// Parallel rays.

#include "placed_camera.h"

namespace photosphere::cameras::plugins {

namespace {

class Orthographic final : public PlacedCamera {
 public:
  Orthographic(const Mat4d& worldFromCamera, const Vec2i& resolution, double width, double near)
      : PlacedCamera(worldFromCamera, resolution, width / 2), m_near(near) {}

  CameraRay ray(const Vec2d& raster) const override {
    const Vec2d w = window(raster);
    return {position() + right() * w.x + up() * w.y - back() * m_near, -back()};
  }

  bool hasEye() const override { return false; }

  std::optional<Mat4d> ndcFromWorld() const override {
    Mat4d ndc(1.0);
    ndc[0][0] = 0.5 / halfWindow().x;
    ndc[1][1] = -0.5 / halfWindow().y;
    ndc[3] = glm::dvec4(0.5, 0.5, 0, 1);
    return ndc * cameraFromWorld();
  }

 private:
  double m_near;  // [scene units]
};

constexpr Param params[] = {
    {.name = "width",
     .type = ParamType::real,
     .unit = "scene units",
     .defaultText = "4.0",
     .help = "horizontal extent of the frame",
     .min = 1e-9},
    nearRow(),
};

std::unique_ptr<Camera> create(const ParamValues& values, const Mat4d& worldFromCamera,
                               const Vec2i& resolution) {
  return std::make_unique<Orthographic>(worldFromCamera, resolution, values.real("width"),
                                        values.real("near"));
}

}  // namespace

extern const CameraPlugin orthographic;
const CameraPlugin orthographic = {
    .name = "orthographic",
    .help = "parallel rays over a frame of a given width",
    .params = params,
    .create = create,
};

}  // namespace photosphere::cameras::plugins
