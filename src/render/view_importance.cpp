#include "photosphere/render/view_importance.h"

#include <algorithm>
#include <cmath>

#include "photosphere/core/parallel.h"
#include "photosphere/core/sequence.h"
#include "photosphere/transport/photon_tracer.h"
#include "photosphere/transport/scatter.h"
#include "photosphere/transport/tracking.h"

namespace photosphere::render {

using transport::ImportanceMap;
using transport::Medium;

namespace {

constexpr int kCells = 28;
constexpr std::size_t kPaths = 1 << 15, kPathsPerChunk = 1 << 11;
constexpr int kMostScatterings = 256;
constexpr std::uint64_t kTries = 256;  // photons of each lamp, for the share that hits
constexpr std::size_t kMostLamps = 64;

// Leaves a flight's length in the cells that it crosses, in pieces of half a cell.
void deposit(const ImportanceMap& map, const Vec3f& o, const Vec3f& d, float length, double weight,
             std::vector<double>& sums) {
  const int pieces = std::clamp(static_cast<int>(std::ceil(2.0f * length / map.edge())), 1, 256);
  const float h = length / static_cast<float>(pieces);
  for (int i = 0; i < pieces; ++i)
    sums[map.index(o + d * ((static_cast<float>(i) + 0.5f) * h))] +=
        weight * static_cast<double>(h);
}

void tracePath(const Medium& medium, const transport::Segment& ray, const ImportanceMap& map,
               Rng& rng, std::vector<double>& sums) {
  transport::TrackingCounters counters;
  transport::Segment segment = ray;
  Rgb power(1.0f);
  for (int event = 0; event < kMostScatterings; ++event) {
    const transport::Collision hit = transport::sampleCollisionOf(
        power, medium, segment.origin, segment.direction, segment.length, rng, counters);
    if (event > 0)
      deposit(map, segment.origin, segment.direction, std::min(hit.distance, segment.length),
              static_cast<double>(meanComponent(power)), sums);
    if (!hit.happened()) return;
    const Vec3f p = segment.origin + segment.direction * hit.distance;
    const transport::ScatterEvent scattered =
        transport::scatter(medium, p, segment.direction, power, rng);
    if (!scattered.survived) return;
    power *= scattered.weight;
    segment = {p, scattered.direction, transport::exitDistance(medium, p, scattered.direction),
               0.0};
  }
}

}  // namespace

std::vector<glm::dvec4> viewPlanes(const cameras::Camera& camera, const Crop& crop, double border,
                                   const lights::LocalSpace& space) {
  const std::optional<Mat4d> ndc = camera.ndcFromWorld();
  if (!ndc) return {};
  const Vec2d size(camera.resolution());
  const Vec2d low = (Vec2d(crop.min) - border) / size, high = (Vec2d(crop.max) + border) / size;
  // World from local; then rows of the projection: x - low w >= 0 and so on, and w >= 0.
  Mat4d world(1.0 / space.metersPerUnit);
  world[3] = glm::dvec4(space.center, 1.0);
  const Mat4d rows = glm::transpose(*ndc * world);
  std::vector<glm::dvec4> planes = {rows[0] - low.x * rows[3], high.x * rows[3] - rows[0],
                                    rows[1] - low.y * rows[3], high.y * rows[3] - rows[1]};
  if (camera.hasEye()) planes.push_back(rows[3]);
  for (glm::dvec4& plane : planes)
    plane /= std::max(glm::length(Vec3d(plane)), 1e-300);
  return planes;
}

double visibleShare(const Medium& medium, const std::vector<glm::dvec4>& planes) {
  if (planes.empty() || medium.bounds().empty()) return 1.0;
  const volume::MajorantGrid& cells = medium.majorants();
  const Vec3d size(cells.cellSize());
  double seen = 0, all = 0;
  Vec3i c(0);
  for (c.z = 0; c.z < cells.dims().z; ++c.z)
    for (c.y = 0; c.y < cells.dims().y; ++c.y)
      for (c.x = 0; c.x < cells.dims().x; ++c.x) {
        const auto majorant = static_cast<double>(cells.majorant(c));
        if (!(majorant > 0)) continue;
        all += majorant;
        const glm::dvec4 center(cells.bounds().min + (Vec3d(c) + 0.5) * size, 1.0);
        if (std::all_of(planes.begin(), planes.end(),
                        [&](const glm::dvec4& plane) { return glm::dot(plane, center) >= 0; }))
          seen += majorant;
      }
  return all > 0 ? seen / all : 1.0;
}

double hittingShare(const Medium& medium, const transport::LightList& lights) {
  const lights::BoundingSphere bounds = transport::boundingSphere(medium);
  double hits = 0, all = 0;
  for (std::size_t i = 0; i < std::min(lights.size(), kMostLamps); ++i)
    for (std::uint64_t n = 0; n < kTries; ++n) {
      const lights::Emission birth = lights[i]->emit(bounds, evenPoint(n));
      const double power = maxComponent(Vec3d(birth.power));
      if (!(power > 0)) continue;
      all += power;
      const transport::Segment inside = transport::clipToMedium(
          medium, birth.origin, birth.direction, std::numeric_limits<double>::infinity());
      if (!(inside.length > 0.0f)) continue;
      for (volume::MajorantGrid::Walk walk(medium.majorants(), inside.origin, inside.direction,
                                           0.0f, inside.length);
           !walk.done(); walk.advance())
        if (walk.majorant() > 0.0f) {
          hits += power;
          break;
        }
    }
  return all > 0 ? hits / all : 1.0;
}

ImportanceMap viewImportance(const cameras::Camera& camera, const Crop& crop,
                             const lights::LocalSpace& space, const Medium& medium, RandomKey key) {
  ImportanceMap map(medium.bounds(), kCells);
  constexpr std::size_t chunks = kPaths / kPathsPerChunk;
  std::vector<std::vector<double>> parts(chunks);
  const Vec2d size(crop.max - crop.min);
  parallelFor(chunks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t chunk = begin; chunk < end; ++chunk) {
      parts[chunk].assign(map.size(), 0.0);
      for (std::size_t i = chunk * kPathsPerChunk; i < (chunk + 1) * kPathsPerChunk; ++i) {
        Rng rng(key, RandomStream::importance, i);
        const Vec2d place = Vec2d(crop.min) + size * Vec2d(rng.uniform2());
        const cameras::CameraRay ray = camera.ray(place);
        const transport::Segment inside =
            transport::clipToMedium(medium, space.localFromWorld(ray.origin), Vec3f(ray.direction),
                                    std::numeric_limits<double>::infinity());
        if (inside.length > 0.0f) tracePath(medium, inside, map, rng, parts[chunk]);
      }
    }
  });
  std::vector<double> sums(map.size());
  for (const std::vector<double>& part : parts)
    for (std::size_t i = 0; i < sums.size(); ++i)
      sums[i] += part[i];
  map.set(sums);
  return map;
}

}  // namespace photosphere::render
