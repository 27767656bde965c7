#include "photosphere/render/light_paths.h"

#include <algorithm>
#include <atomic>
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
  void add(const Vec2d& raster, const Vec3d& value, const Flight& flight) {
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
            m_sums.add(3 * pixel + c, weight * value[static_cast<int>(c)],
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

// The light of a pixel in the middle of the picture if all photons scattered in the smoke's disc
// there [W m^-2 sr^-1]: of the size of what is summed, which is all that a quantum needs. Not where
// the smoke lies in the picture: off the axis a pixel covers next to nothing.
double typicalLight(const cameras::Camera& camera, const lights::LocalSpace& space,
                    const lights::BoundingSphere& smoke, double power) {
  const Vec3d center = space.worldFromLocal(smoke.center);
  const double radius = std::max(smoke.radius / space.metersPerUnit, 1e-300);
  const cameras::CameraRay middle = camera.ray(0.5 * Vec2d(camera.resolution()));
  const double away = std::max(radius, glm::length(center - middle.origin));
  const auto seen = camera.project(middle.origin + away * middle.direction);
  const double perArea = seen ? seen->pixelsPerArea() : 0.0;
  return power * perArea / (4 * kPi * space.metersPerUnit * space.metersPerUnit);
}

// Units of a photon of that light, if there are no more than this many; of more photons the sum
// keeps its room, and the quantum stays far below what one of them brings.
constexpr double kUnits = 0x1p24;
constexpr double kPhotons = 0x1p20;

double quantumOf(double light, std::uint64_t photons) {
  const double quantum = light / kUnits * std::max(1.0, static_cast<double>(photons) / kPhotons);
  return quantum > 0 && std::isfinite(quantum) ? quantum : 1.0;
}

// What some flights were counted as.
struct FlightCounts {
  transport::TrackingCounters tracking;
  std::uint64_t joined = 0, capped = 0;
  double cappedPower = 0.0;  // [W]
};

// The same from all threads.
struct SharedCounts {
  std::atomic<std::uint64_t> joined{0}, majorantViolations{0}, capped{0};
  std::atomic<double> cappedPower{0.0};

  void add(const FlightCounts& counts) {
    joined += counts.joined;
    majorantViolations += counts.tracking.majorantViolations;
    capped += counts.capped;
    cappedPower += counts.cappedPower;
  }

  void keep(StateWriter& w) const {
    w.value(joined.load());
    w.value(majorantViolations.load());
    w.value(capped.load());
    w.value(cappedPower.load());
  }
  void resume(StateReader& r) {
    for (auto* count : {&joined, &majorantViolations, &capped})
      *count = r.value<std::uint64_t>();
    cappedPower = r.value<double>();
  }
};

// Joins every collision that is not a lamp's first to the eye.
template <class Light>
class EyeSink final : public transport::FlightSink {
 public:
  EyeSink(const Medium& medium, const Eye& eye, const LightPathOptions& options, Film& film,
          SharedCounts& counts)
      : m_medium(medium), m_eye(eye), m_options(options), m_film(film), m_counts(counts) {}

  void consume(std::span<const Flight> flights) override {
    // What is left of the trace would be for nothing; a sink must not throw.
    if (m_film.sums().overflows > 0) return;
    FlightCounts counts;
    for (const Flight& flight : flights) {
      if (!flight.collided() || !isSought(flight)) continue;
      if (isBeyondCap(flight))
        count(flight, counts);
      else
        join(flight, counts);
    }
    m_counts.add(counts);
  }

 private:
  // A lamp's first collision is single scattering; the smoke's own is not.
  static bool isSought(const Flight& flight) {
    return flight.scatterings > 0 || flight.light == transport::kEmittedBySmoke;
  }

  bool isBeyondCap(const Flight& flight) const {
    return m_options.maxScatter > 0 &&
           flight.scatterings >= static_cast<std::uint32_t>(m_options.maxScatter);
  }

  // Of the events that are left out only the first: what would come after it is not there.
  void count(const Flight& flight, FlightCounts& counts) const {
    if (flight.scatterings > static_cast<std::uint32_t>(m_options.maxScatter)) return;
    ++counts.capped;
    counts.cappedPower += static_cast<double>(meanComponent(flight.power));
  }

  void join(const Flight& flight, FlightCounts& counts) {
    const Vec3f p = flight.origin + flight.direction * flight.length;
    Rng rng(m_options.key, RandomStream::connection,
            depositHash(m_options.key, flight.photon, flight.ordinal, ~0u));
    const auto sight = m_eye.see(p, rng);
    if (!sight || !m_film.reaches(sight->raster)) return;
    const Rgb scattered = flight.collisionPower() *
                          transport::phaseAlbedo(m_medium, p, flight.direction, sight->direction);
    if (!(maxComponent(scattered) > 0.0f)) return;
    const float inside = transport::exitDistance(m_medium, p, sight->direction);
    const Light passed = transport::trackTransmittance<Light>(
        m_medium, p, sight->direction, std::min(sight->distance, inside), rng, counts.tracking);
    const Vec3d value = Vec3d(scattered * passed) * sight->pixelsPerArea;
    if (!(std::max({value.x, value.y, value.z}) > 0)) return;
    ++counts.joined;
    m_film.add(sight->raster, value, flight);
  }

  const Medium& m_medium;
  const Eye& m_eye;
  const LightPathOptions& m_options;
  Film& m_film;
  SharedCounts& m_counts;
};

}  // namespace

LightPaths traceLightPaths(const cameras::Camera& camera, const Medium& medium,
                           const transport::LightList& lights, const LightPathOptions& options) {
  const double power = transport::sharedPower(medium, lights);
  const double light =
      typicalLight(camera, options.space, transport::boundingSphere(medium), power);
  Film film(camera, options, quantumOf(light, options.photons));
  SharedCounts counts;
  const Eye eye(camera, options.space, options.lens);
  transport::TraceOptions trace;
  trace.photons = options.photons;
  trace.key = options.key;
  trace.guide = options.guide;
  const transport::TraceKeeping keeping{options.checkpoint, options.part,
                                        [&](StateWriter& w) {
                                          counts.keep(w);
                                          w.value(film.sums().overflows.load());
                                          w.value(film.sums().sums);
                                        },
                                        [&](StateReader& r) {
                                          counts.resume(r);
                                          film.sums().overflows = r.value<std::uint64_t>();
                                          r.value(film.sums().sums);
                                          if (film.sums().sums.size() != 3 * film.pixels())
                                            r.fail();
                                        }};
  LightPaths paths;
  const auto run = [&]<class Light>(Light) {
    EyeSink<Light> sink(medium, eye, options, film, counts);
    paths.traced = transport::tracePhotons(medium, lights, trace, sink, keeping);
  };
  if (medium.isColoured())
    run(Rgb());
  else
    run(float());
  paths.joined = counts.joined;
  paths.capped = counts.capped;
  if (power > 0) paths.cappedShare = counts.cappedPower / power;
  paths.traced.majorantViolations += counts.majorantViolations;
  const FixedSums& sums = film.sums();
  if (sums.overflows > 0)
    throw Error(ExitCode::unspecified,
                "photons were too bright for a pixel's 64-bit sum: the eye is all but where they "
                "scatter; move it, or use estimator.type = \"path_traced\"");
  const double worth =
      sums.quantum / static_cast<double>(std::max<std::uint64_t>(1, trace.photons));
  paths.multiple.resize(film.pixels());
  for (std::size_t i = 0; i < paths.multiple.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      paths.multiple[i][static_cast<int>(c)] =
          static_cast<float>(static_cast<double>(sums.sums[3 * i + c]) * worth);
  return paths;
}

}  // namespace photosphere::render
