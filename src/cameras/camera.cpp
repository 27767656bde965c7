#include "photosphere/cameras/camera.h"

#include <fmt/format.h>

#include <cmath>

#include "photosphere/core/error.h"
#include "placed_camera.h"

namespace photosphere::cameras {

std::span<const Param> cameraParams() {
  static constexpr Param params[] = {
      {.name = "position",
       .type = ParamType::vec3,
       .unit = "scene units",
       .defaultText = "[0, 0, 5]",
       .help = "eye; when neither it nor `matrix` is given, the camera frames the smoke"},
      {.name = "look_at",
       .type = ParamType::vec3,
       .unit = "scene units",
       .defaultText = "[0, 0, 0]",
       .help = "point in the middle of the frame"},
      {.name = "up",
       .type = ParamType::vec3,
       .unit = "",
       .defaultText = "[0, 1, 0]",
       .help = "direction that is upward in the frame"},
      {.name = "matrix",
       .type = ParamType::matrix,
       .unit = "",
       .defaultText = "[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]",
       .help = "worldFromCamera, row-major, in place of position, look_at and up; the camera looks "
               "along its -Z"},
      {.name = "resolution",
       .type = ParamType::vec2,
       .unit = "pixels",
       .defaultText = "[1280, 720]",
       .help = "width and height of the frame",
       .min = 1,
       .max = 65536},
      {.name = "shutter",
       .type = ParamType::vec2,
       .unit = "frames",
       .defaultText = "[-0.25, 0.25]",
       .help = "when it opens and closes, relative to the frame; the camera moves in between where "
               "it has keys or a file"},
      {.name = "fstop",
       .type = ParamType::real,
       .unit = "",
       .defaultText = "0.0",
       .help = "f-number of a perspective camera's lens, for depth of field; 0 = pinhole",
       .min = 0},
      {.name = "focus_distance",
       .type = ParamType::real,
       .unit = "scene units",
       .defaultText = "0.0",
       .help = "along the axis, in focus; acts only with fstop; 0 = the middle of the smoke",
       .min = 0},
      {.name = "file",
       .type = ParamType::text,
       .unit = "",
       .defaultText = "",
       .help = "Nuke camera (.chan) in place of position, look_at, up, matrix and, where its lines "
               "have an eighth number, the field of view: lines of frame, translation, rotation "
               "[degrees, order ZXY] and vertical field of view [degrees; the resolution's aspect "
               "makes it horizontal]; between lines the rotation turns evenly"},
  };
  return params;
}

Mat4d lookAt(const Vec3d& eye, const Vec3d& target, const Vec3d& up) {
  const Vec3d away = eye - target;
  const double distance = glm::length(away);
  if (!(distance > 0) || !std::isfinite(distance))
    throw ConfigError(
        "`position` and `look_at` must be two finite, different points; move one of "
        "them");
  const Vec3d z = away / distance;
  const double upLength = glm::length(up);
  Vec3d side = upLength > 0 && std::isfinite(upLength) ? glm::cross(up / upLength, z) : Vec3d(0.0);
  if (glm::dot(side, side) < 1e-12) {
    // A view along `up` (or no `up`): the world axis farthest from the view serves.
    const Vec3d a = glm::abs(z);
    const Vec3d other = a.z <= a.x && a.z <= a.y ? Vec3d(0, 0, 1)
                        : a.y <= a.x             ? Vec3d(0, 1, 0)
                                                 : Vec3d(1, 0, 0);
    side = glm::cross(other, z);
  }
  const Vec3d x = glm::normalize(side), y = glm::cross(z, x);
  return Mat4d(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(eye, 1));
}

Mat4d worldFromCameraValues(const ParamValues& common) {
  if (!common.given("matrix"))
    return lookAt(common.vec3("position"), common.vec3("look_at"), common.vec3("up"));
  Mat4d m = common.matrix("matrix");
  const double scale = glm::length(Vec3d(m[0]));
  const Mat3d rotation = Mat3d(m) / scale;
  const Mat3d product = glm::transpose(rotation) * rotation;
  double error = scale > 0 && std::isfinite(scale) ? 0.0 : 1.0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      error = glm::max(error, std::abs(product[i][j] - (i == j ? 1 : 0)));
  const bool affine = m[0][3] == 0 && m[1][3] == 0 && m[2][3] == 0 && m[3][3] == 1;
  // Written this way round, so that NaN fails too. Six digits are what text files carry.
  if (!(error < 1e-5) || !affine || !(glm::determinant(rotation) > 0))
    throw ConfigError(
        "`matrix` must be a rotation, one scale for all axes and a translation "
        "(row-major, "
        "the translation in its last column); it is sheared, mirrored, or transposed");
  const Vec3d x = glm::normalize(rotation[0]);
  const Vec3d z = glm::normalize(glm::cross(x, rotation[1]));
  return Mat4d(glm::dvec4(x, 0), glm::dvec4(glm::cross(z, x), 0), glm::dvec4(z, 0), m[3]);
}

std::optional<Projection> Camera::project(const Vec3d& world) const {
  const std::optional<Mat4d> ndc = ndcFromWorld();
  if (!ndc) return std::nullopt;
  const glm::dvec4 seen = *ndc * glm::dvec4(world, 1.0);
  if (!(seen.w > 0)) return std::nullopt;
  const Mat4d rows = glm::transpose(*ndc);
  Projection p;
  for (int i = 0; i < 2; ++i) {
    const double position = seen[i] / seen.w, size = resolution()[i];
    p.raster[i] = position * size;
    p.gradient[static_cast<std::size_t>(i)] =
        size / seen.w * (Vec3d(rows[i]) - position * Vec3d(rows[3]));
  }
  return p;
}

PlacedCamera::PlacedCamera(const Mat4d& worldFromCamera, const Vec2i& resolution, double halfWidth)
    : m_worldFromCamera(worldFromCamera), m_resolution(resolution) {
  if (resolution.x < 1 || resolution.y < 1)
    throw ConfigError(fmt::format("resolution {} x {} holds no pixel; use at least 1 x 1",
                                  resolution.x, resolution.y));
  if (!(halfWidth > 0) || !std::isfinite(halfWidth))
    throw ConfigError("the frame has no width; check fov, focal_length, width");
  m_half = {halfWidth, halfWidth * resolution.y / resolution.x};
}

Mat4d PlacedCamera::cameraFromWorld() const {
  // The placement is rigid: its inverse is the transpose. The third row points forward.
  const Vec3d x = right(), y = up(), forward = -back(), eye = position();
  Mat4d m(1.0);
  for (int i = 0; i < 3; ++i) {
    m[i][0] = x[i];
    m[i][1] = y[i];
    m[i][2] = forward[i];
  }
  m[3] = glm::dvec4(-glm::dot(x, eye), -glm::dot(y, eye), -glm::dot(forward, eye), 1);
  return m;
}

}  // namespace photosphere::cameras
