#include "photosphere/render/light_paths.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "photosphere/core/error.h"
#include "photosphere/core/fixed_point.h"
#include "photosphere/core/sampling.h"
#include "photosphere/transport/scatter.h"
#include "photosphere/transport/tracking.h"

namespace photosphere::render {

namespace {

using transport::Flight;
using transport::Medium;

// A place as the camera sees it through one point of its lens.
struct Sight {
  Vec2d raster{0.0};
  Vec3f direction{0.0f};     // unit, from the place toward the eye
  float distance = 0.0f;     // to where rays begin [m]
  double pixelsPerArea = 0;  // of an area across the ray [pixels^2 / m^2]
};

// Sees places of local space.
class Eye {
 public:
  Eye(const cameras::Camera& camera, const lights::LocalSpace& space, const Lens& lens)
      : m_camera(camera),
        m_space(space),
        m_lens(lens),
        m_place(cameras::placementOf(camera)),
        m_unitsPerMeter(1.0 / space.metersPerUnit) {}

  /// Nothing for a place behind the eye or before where rays begin.
  std::optional<Sight> see(const Vec3f& p, Rng& rng) const {
    const Vec3d world = m_space.worldFromLocal(Vec3d(p));
    return m_lens.radius > 0.0 ? throughLens(world, sampleDisc(rng.uniform2())) : pinhole(world);
  }

 private:
  std::optional<Sight> pinhole(const Vec3d& world) const {
    const auto seen = m_camera.project(world);
    if (!seen) return std::nullopt;
    const cameras::CameraRay ray = m_camera.ray(seen->raster);
    return sight(*seen, glm::dot(world - ray.origin, ray.direction), ray.direction);
  }

  // The ray from the point of the lens through the place goes on, or has gone, through the plane in
  // focus where a ray through the middle of the lens meets it.
  std::optional<Sight> throughLens(const Vec3d& world, const Vec2f& point) const {
    const Vec3d eye = m_place.eye + m_lens.radius * (m_place.right * static_cast<double>(point.x) +
                                                     m_place.up * static_cast<double>(point.y));
    const Vec3d way = world - eye;
    const double depth = glm::dot(way, m_place.axis);
    if (!(depth > 0)) return std::nullopt;
    const double scale = m_lens.focusDistance / depth;
    auto seen = m_camera.project(eye + way * scale);
    if (!seen) return std::nullopt;
    for (Vec3d& gradient : seen->gradient)
      gradient = scale * (gradient - m_place.axis * (glm::dot(gradient, way) / depth));
    const Vec3d begin = m_camera.ray(seen->raster).origin;
    const double near = glm::dot(begin - m_place.eye, m_place.axis);
    const double length = glm::length(way);
    return sight(*seen, length * (1.0 - near / depth), way / length);
  }

  std::optional<Sight> sight(const cameras::Projection& seen, double distance,
                             const Vec3d& direction) const {
    if (!(distance > 0)) return std::nullopt;
    return Sight{seen.raster, Vec3f(-direction),
                 static_cast<float>(distance * m_space.metersPerUnit),
                 seen.pixelsPerArea() * m_unitsPerMeter * m_unitsPerMeter};
  }

  const cameras::Camera& m_camera;
  const lights::LocalSpace& m_space;
  const Lens& m_lens;
  cameras::Placement m_place;
  double m_unitsPerMeter;
};

// Integral of a pixel filter over the picture [pixels^2].
double integralOf(const PixelFilter& filter) {
  constexpr int kNodes = 4096;
  const double h = 2 * filter.radius() / kNodes;
  double sum = 0;
  for (int i = 0; i < kNodes; ++i)
    sum += static_cast<double>(filter.weight(Vec2d(-filter.radius() + (i + 0.5) * h, 0)));
  sum *= h;
  return sum * sum / static_cast<double>(filter.weight(Vec2d(0.0)));
}

// Pixels on which light falls through the filter, from all threads.
class Film {
 public:
  Film(const cameras::Camera& camera, const LightPathOptions& options, double quantum)
      : m_filter(options.filter, options.filterWidth),
        m_scale(1.0 / integralOf(m_filter)),
        m_crop(options.crop),
        m_size(options.crop.max - options.crop.min),
        m_key(options.key) {
    if (camera.isPanorama()) m_panorama = camera.resolution();
    m_sums.quantum = quantum;
    m_sums.sums.assign(3 * pixels(), 0);
  }

  std::size_t pixels() const {
    return static_cast<std::size_t>(m_size.x) * static_cast<std::size_t>(m_size.y);
  }
  FixedSums& sums() { return m_sums; }
  const FixedSums& sums() const { return m_sums; }

  /// Whether light there reaches a pixel.
  bool reaches(const Vec2d& raster) const {
    bool any = false;
    forEachImage(raster, [&](const Vec2d& place) { any = any || !covered(place).empty(); });
    return any;
  }

  /// @param value  light times pixels
  void add(const Vec2d& raster, const Rgb& value, const Flight& flight) {
    forEachImage(raster, [&](const Vec2d& place) {
      const Pixels on = covered(place);
      for (int y = on.min.y; y < on.max.y; ++y)
        for (int x = on.min.x; x < on.max.x; ++x) {
          const double weight =
              m_scale * static_cast<double>(m_filter.weight(place - Vec2d(x + 0.5, y + 0.5)));
          if (!(weight > 0)) continue;
          const auto pixel =
              static_cast<std::size_t>(y - m_crop.min.y) * static_cast<std::size_t>(m_size.x) +
              static_cast<std::size_t>(x - m_crop.min.x);
          // Rounded by the pixel's place in the frame: the crop changes no bit.
          const auto deposit = static_cast<std::uint32_t>(y) << 16 ^ static_cast<std::uint32_t>(x);
          for (std::size_t c = 0; c < 3; ++c)
            m_sums.add(3 * pixel + c, weight * static_cast<double>(value[static_cast<int>(c)]),
                       roundingBits(m_key, flight.photon, flight.ordinal,
                                    4 * deposit + static_cast<std::uint32_t>(c)));
        }
    });
  }

 private:
  struct Pixels {
    Vec2i min{0}, max{0};
    bool empty() const { return min.x >= max.x || min.y >= max.y; }
  };

  // Pixels of the crop whose filter reaches a place.
  Pixels covered(const Vec2d& place) const {
    const double r = m_filter.radius();
    const Vec2d low = glm::max(glm::ceil(place - 0.5 - r), Vec2d(m_crop.min));
    const Vec2d high = glm::min(glm::floor(place - 0.5 + r) + 1.0, Vec2d(m_crop.max));
    // Compared as they are: far from the frame they are no integers.
    if (!(low.x < high.x && low.y < high.y)) return {};
    return {Vec2i(low), Vec2i(high)};
  }

  // A panorama goes on beyond its borders: around at the sides, over the poles above and below.
  template <class Function>
  void forEachImage(const Vec2d& raster, const Function& function) const {
    function(raster);
    if (m_panorama.x == 0) return;
    const double w = m_panorama.x, h = m_panorama.y;
    for (const double turn : {-w, w})
      function({raster.x + turn, raster.y});
    for (const double turn : {-0.5 * w, 0.5 * w, 1.5 * w, -1.5 * w}) {
      function({raster.x + turn, -raster.y});
      function({raster.x + turn, 2 * h - raster.y});
    }
  }

  PixelFilter m_filter;
  double m_scale;
  Crop m_crop;
  Vec2i m_size;
  Vec2i m_panorama{0};  // its resolution; 0 for any other camera
  RandomKey m_key;
  FixedSums m_sums;
};

// The light of a pixel whose photons share `power` evenly over the smoke's disc [W m^-2 sr^-1]: of
// the size of what is summed, which is all that a quantum needs.
double typicalLight(const cameras::Camera& camera, const lights::LocalSpace& space,
                    const lights::BoundingSphere& smoke, double power) {
  const Vec3d center = space.worldFromLocal(smoke.center);
  const double radius = std::max(smoke.radius / space.metersPerUnit, 1e-300);
  const Vec2d size(camera.resolution());
  double perArea = size.x * size.y / (radius * radius);
  const bool outside = !camera.hasEye() || glm::length(center - camera.position()) > radius;
  if (const auto seen = camera.project(center); seen && outside) perArea = seen->pixelsPerArea();
  return power * perArea / (4 * kPi * space.metersPerUnit * space.metersPerUnit);
}

// Joins every collision that is not a lamp's first to the eye.
template <class Light>
class EyeSink final : public transport::FlightSink {
 public:
  EyeSink(const Medium& medium, const Eye& eye, RandomKey key, Film& film)
      : m_medium(medium), m_eye(eye), m_key(key), m_film(film) {}

  void consume(std::span<const Flight> flights) override {
    transport::TrackingCounters counters;
    for (const Flight& flight : flights)
      if (flight.collided() &&
          (flight.scatterings > 0 || flight.light == transport::kEmittedBySmoke))
        join(flight, counters);
  }

 private:
  void join(const Flight& flight, transport::TrackingCounters& counters) {
    const Vec3f p = flight.origin + flight.direction * flight.length;
    Rng rng(m_key, RandomStream::connection,
            depositHash(m_key, flight.photon, flight.ordinal, ~0u));
    const auto sight = m_eye.see(p, rng);
    if (!sight || !m_film.reaches(sight->raster)) return;
    const Rgb scattered =
        flight.power * transport::phaseAlbedo(m_medium, p, flight.direction, sight->direction);
    if (!(maxComponent(scattered) > 0.0f)) return;
    const float inside = transport::exitDistance(m_medium, p, sight->direction);
    const Light passed = transport::trackTransmittance<Light>(
        m_medium, p, sight->direction, std::min(sight->distance, inside), rng, counters);
    const Rgb value = scattered * passed * static_cast<float>(sight->pixelsPerArea);
    if (maxComponent(value) > 0.0f) m_film.add(sight->raster, value, flight);
  }

  const Medium& m_medium;
  const Eye& m_eye;
  RandomKey m_key;
  Film& m_film;
};

}  // namespace

std::vector<Rgb> traceLightPaths(const cameras::Camera& camera, const Medium& medium,
                                 const transport::LightList& lights,
                                 const LightPathOptions& options,
                                 transport::TraceStatistics& statistics) {
  const double light = typicalLight(camera, options.space, transport::boundingSphere(medium),
                                    transport::sharedPower(medium, lights));
  Film film(camera, options, light > 0 && std::isfinite(light) ? light * 0x1p-24 : 1.0);
  const Eye eye(camera, options.space, options.lens);
  transport::TraceOptions trace;
  trace.photons = options.photons;
  trace.key = options.key;
  trace.guide = options.guide;
  const transport::TraceKeeping keeping{options.checkpoint, options.part,
                                        [&](StateWriter& w) {
                                          w.value(film.sums().overflows.load());
                                          w.value(film.sums().sums);
                                        },
                                        [&](StateReader& r) {
                                          film.sums().overflows = r.value<std::uint64_t>();
                                          r.value(film.sums().sums);
                                          if (film.sums().sums.size() != 3 * film.pixels())
                                            r.fail();
                                        }};
  const auto run = [&]<class Light>(Light) {
    EyeSink<Light> sink(medium, eye, options.key, film);
    statistics = transport::tracePhotons(medium, lights, trace, sink, keeping);
  };
  if (medium.isColoured())
    run(Rgb());
  else
    run(float());
  const FixedSums& sums = film.sums();
  if (sums.overflows > 0)
    throw Error(ExitCode::unspecified,
                fmt::format("{} photons were too bright for a pixel's 64-bit sum: the eye is all "
                            "but where they scatter; move it, or use estimator.type = "
                            "\"path_traced\"",
                            sums.overflows.load()));
  const double worth =
      sums.quantum / static_cast<double>(std::max<std::uint64_t>(1, trace.photons));
  std::vector<Rgb> pixels(film.pixels());
  for (std::size_t i = 0; i < pixels.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      pixels[i][static_cast<int>(c)] =
          static_cast<float>(static_cast<double>(sums.sums[3 * i + c]) * worth);
  return pixels;
}

}  // namespace photosphere::render
