#include "photosphere/cameras/moving_camera.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace photosphere::cameras {

namespace {

constexpr int kDeepest =
    8;  // halvings between two keys: the shutter of half a turn has 256 moments
constexpr int kLattice = 9;  // raster positions along an edge of the frame, to look for blur

// Even rays between those of two cameras.
CameraRay rayBetween(const Camera& from, const Camera& to, const Vec2d& raster, double t) {
  const CameraRay a = from.ray(raster);
  if (t <= 0) return a;
  const CameraRay b = to.ray(raster);
  return {glm::mix(a.origin, b.origin, t), glm::normalize(glm::mix(a.direction, b.direction, t))};
}

double radiusOf(const Box3d& box) {
  return box.empty() ? 1.0 : 0.5 * glm::length(box.extent());
}
Vec3d centerOf(const Box3d& box, const Camera& camera) {
  return box.empty() ? camera.position() + camera.viewDirection() : box.center();
}

// How far a ray between two cameras is off one of its own, over the size of a pixel there.
double errorBetween(const Camera& from, const Camera& middle, const Camera& to,
                    const Box3d& smoke) {
  const Vec2d size(middle.resolution());
  const double distance = glm::length(centerOf(smoke, middle) - middle.position());
  const double reach = radiusOf(smoke);
  double worst = 0;
  // Up to the borders, and not symmetric: a turn leaves what lies in its own plane exact.
  constexpr double places[] = {0.0, 0.3, 0.65, 1.0};
  for (int i = 0; i < 16; ++i) {
    const Vec2d raster = size * Vec2d(places[i % 4], places[i / 4]);
    const CameraRay exact = middle.ray(raster);
    // Both neighbours: at the pole of a panorama one of them is the pixel itself.
    const CameraRay beside = middle.ray(raster + Vec2d(1, 0));
    const CameraRay below = middle.ray(raster + Vec2d(0, 1));
    const CameraRay even = rayBetween(from, to, raster, 0.5);
    for (const double s : {std::max(distance - reach, 0.05 * reach), distance + reach}) {
      const Vec3d p = exact.origin + exact.direction * s;
      const double pixel = std::max(glm::length(beside.origin + beside.direction * s - p),
                                    glm::length(below.origin + below.direction * s - p));
      worst = std::max(worst, glm::length(even.origin + even.direction * s - p) / pixel);
    }
  }
  return worst;
}

// Where on the picture a point is seen; nothing behind the camera.
std::optional<Vec2d> rasterOf(const Camera& camera, const Vec3d& p) {
  const Vec2d size(camera.resolution());
  if (const std::optional<Mat4d> ndc = camera.ndcFromWorld()) {
    const glm::dvec4 h = *ndc * glm::dvec4(p, 1.0);
    if (!(h.w > 0)) return std::nullopt;
    return Vec2d(h) / h.w * size;
  }
  const Placement place = placementOf(camera);
  const Vec3d d = glm::normalize(p - place.eye);
  const double longitude = std::atan2(glm::dot(d, place.right), glm::dot(d, place.axis));
  const double latitude = std::asin(glm::clamp(glm::dot(d, place.up), -1.0, 1.0));
  return size * Vec2d(0.5 + longitude / (2 * kPi), 0.5 - latitude / kPi);
}

// Over the picture, around a panorama by the shorter way.
double way(const Camera& camera, const Vec2d& a, const Vec2d& b) {
  Vec2d d = glm::abs(a - b);
  if (camera.isPanorama()) d.x = std::min(d.x, camera.resolution().x - d.x);
  return glm::length(d);
}

// Points of the box that the camera sees: where rays enter and leave it, and its corners.
std::vector<Vec3d> seenPoints(const Camera& camera, const Box3d& box) {
  const Vec2d size(camera.resolution());
  std::vector<Vec3d> points;
  const auto add = [&](const Vec3d& p) {
    const std::optional<Vec2d> raster = rasterOf(camera, p);
    if (raster && raster->x >= 0 && raster->y >= 0 && raster->x <= size.x && raster->y <= size.y)
      points.push_back(p);
  };
  add(box.center());
  for (int i = 0; i < 8; ++i)
    add(box.corner(i));
  const double nearest = 0.01 * radiusOf(box);  // at the eye itself everything blurs
  for (int i = 0; i < kLattice * kLattice; ++i) {
    const Vec2d raster = size * Vec2d(i % kLattice, i / kLattice) / (kLattice - 1.0);
    const CameraRay ray = camera.ray(raster);
    const Vec3d a = (box.min - ray.origin) / ray.direction,
                b = (box.max - ray.origin) / ray.direction;
    const Vec3d low = glm::min(a, b), high = glm::max(a, b);
    const double enter = std::max({low.x, low.y, low.z, nearest});
    const double leave = std::min({high.x, high.y, high.z});
    if (!(enter < leave)) continue;
    points.push_back(ray.origin + ray.direction * enter);
    points.push_back(ray.origin + ray.direction * leave);
  }
  return points;
}

double angleBetween(const Vec3d& a, const Vec3d& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

}  // namespace

Placement placementOf(const Camera& camera) {
  const Mat4d& m = camera.worldFromCamera();
  return {camera.position(), glm::normalize(Vec3d(m[0])), glm::normalize(Vec3d(m[1])),
          camera.viewDirection()};
}

MovingCamera::MovingCamera(const At& at, double open, double close, std::span<const double> keys,
                           const Box3d& smoke) {
  std::vector<double> times{0.0, 1.0};
  for (const double key : keys)
    if (key > open && key < close) times.push_back((key - open) / (close - open));
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  m_moments.push_back({0.0, at(open)});
  for (std::size_t i = 1; i < times.size(); ++i)
    refine(at, open, close, m_moments, {times[i], at(open + times[i] * (close - open))}, smoke, 0);
}

// Adds moments after the last of `out`, up to one more.
void MovingCamera::refine(const At& at, double open, double close, std::vector<Moment>& out,
                          Moment last, const Box3d& smoke, int depth) const {
  const double u = 0.5 * (out.back().u + last.u);
  Moment middle{u, at(open + u * (close - open))};
  // Written this way round, so that opposite directions, which have no middle, count as an error.
  const double error = errorBetween(*out.back().camera, *middle.camera, *last.camera, smoke);
  if (depth < kDeepest && !(error <= kTolerance)) {
    refine(at, open, close, out, std::move(middle), smoke, depth + 1);
    refine(at, open, close, out, std::move(last), smoke, depth + 1);
    return;
  }
  out.push_back(std::move(last));
}

MovingCamera::Between MovingCamera::between(double u) const {
  const auto after =
      std::upper_bound(m_moments.begin() + 1, m_moments.end() - 1, u,
                       [](double time, const Moment& moment) { return time < moment.u; });
  const Moment& from = *(after - 1);
  const double t = (u - from.u) / (after->u - from.u);
  return {*from.camera, *after->camera, glm::clamp(t, 0.0, 1.0)};
}

CameraRay MovingCamera::ray(const Vec2d& raster, double u) const {
  const Between b = between(u);
  return rayBetween(b.from, b.to, raster, b.t);
}

Placement MovingCamera::placement(double u) const {
  const Between b = between(u);
  const Placement from = placementOf(b.from), to = placementOf(b.to);
  return {glm::mix(from.eye, to.eye, b.t), glm::normalize(glm::mix(from.right, to.right, b.t)),
          glm::normalize(glm::mix(from.up, to.up, b.t)),
          glm::normalize(glm::mix(from.axis, to.axis, b.t))};
}

double MovingCamera::blur(const Box3d& box) const {
  if (box.empty()) return 0;
  const Camera& first = *m_moments.front().camera;
  const double most = glm::length(Vec2d(first.resolution()));
  double longest = 0;
  const Camera& last = *m_moments.back().camera;
  const Camera& middle = *m_moments[m_moments.size() / 2].camera;
  for (const Camera* seen : {&first, &middle, &last})
    for (const Vec3d& p : seenPoints(*seen, box)) {
      const auto begin = rasterOf(first, p), end = rasterOf(last, p);
      for (const Moment& moment : m_moments) {
        const auto now = rasterOf(*moment.camera, p);
        if (!begin || !end || !now) return most;
        longest = std::max({longest, way(first, *begin, *now), way(first, *end, *now)});
      }
    }
  return std::min(longest, most);
}

double MovingCamera::parallax(const Box3d& box) const {
  const Placement middle = placement(0.5);
  double widest = 0;
  for (const Moment& moment : m_moments) {
    const Placement now = placementOf(*moment.camera);
    if (!moment.camera->hasEye()) {
      widest = std::max(widest, angleBetween(middle.axis, now.axis));
      continue;
    }
    for (int i = 0; i < 8 && !box.empty(); ++i)
      widest = std::max(widest, angleBetween(middle.eye - box.corner(i), now.eye - box.corner(i)));
  }
  return widest;
}

}  // namespace photosphere::cameras
