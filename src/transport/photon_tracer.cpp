#include "photosphere/transport/photon_tracer.h"

#include <algorithm>

#include "photosphere/core/parallel.h"
#include "photosphere/core/progress.h"
#include "photosphere/transport/scatter.h"
#include "photosphere/transport/tracking.h"

namespace photosphere::transport {

namespace {

constexpr std::size_t kBatch = 1024;  // flights handed to the sink at once
constexpr std::uint64_t kPhotonsPerChunk = 4096;

// The R5 additive recurrence (Roberts 2018) as 64-bit fixed point: photon i takes point i, so
// births are spread evenly over lights, directions and discs whatever part of the photons a shard
// traces.
struct BirthSequence {
  std::array<std::uint64_t, 5> step{}, shift{};

  explicit BirthSequence(RandomKey key) {
    constexpr double inversePhi = 1.0 / 1.1347241384015194;  // root of x^6 = x + 1
    double alpha = 1.0;
    Rng rng(key, RandomStream::photon, ~0ull);
    for (std::size_t k = 0; k < step.size(); ++k) {
      alpha *= inversePhi;
      step[k] = static_cast<std::uint64_t>(alpha * 0x1p63) << 1;
      const std::uint64_t high = rng.bits();
      shift[k] = high << 32 | rng.bits();
    }
  }
  float operator()(std::uint64_t photon, std::size_t dimension) const {
    const std::uint64_t x = photon * step[dimension] + shift[dimension];
    return static_cast<float>(x >> 40) * 0x1p-24f;
  }
};

// Chooses a light in proportion to its power.
class LightChoice {
 public:
  LightChoice(const LightList& lights, const lights::BoundingSphere& bounds) {
    double sum = 0;
    for (const auto& light : lights) {
      const double p = maxComponent(Vec3d(light->power(bounds)));
      sum += p > 0 ? p : 0;
      m_cumulative.push_back(sum);
    }
    m_total = sum;
  }
  bool dark() const { return !(m_total > 0); }
  std::size_t choose(float u) const {
    const double target = static_cast<double>(u) * m_total;
    const auto at = std::upper_bound(m_cumulative.begin(), m_cumulative.end(), target);
    return std::min(static_cast<std::size_t>(at - m_cumulative.begin()), m_cumulative.size() - 1);
  }
  double probability(std::size_t i) const {
    return (m_cumulative[i] - (i ? m_cumulative[i - 1] : 0.0)) / m_total;
  }

 private:
  std::vector<double> m_cumulative;
  double m_total = 0;
};

void accumulate(TraceStatistics& sum, const TraceStatistics& part) {
  sum.photons += part.photons;
  sum.scatterings += part.scatterings;
  sum.flights += part.flights;
  sum.capped += part.capped;
  sum.majorantViolations += part.majorantViolations;
  sum.emitted += part.emitted;
  sum.missed += part.missed;
  sum.absorbed += part.absorbed;
  sum.escaped += part.escaped;
  sum.cappedPower += part.cappedPower;
}

// Collects the flights of one chunk of photons and hands them on in batches.
class Batch {
 public:
  explicit Batch(FlightSink& sink) : m_sink(&sink) { m_flights.reserve(kBatch); }
  ~Batch() { flush(); }
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;
  void add(const Flight& flight) {
    m_flights.push_back(flight);
    if (m_flights.size() == kBatch) flush();
  }

 private:
  void flush() {
    if (!m_flights.empty()) m_sink->consume(m_flights);
    m_flights.clear();
  }
  FlightSink* m_sink;
  std::vector<Flight> m_flights;
};

// Follows one photon from its entry into the bounds to its end.
void follow(const Medium& medium, Flight flight, Rng& rng, Batch& batch, TraceStatistics& stats,
            TrackingCounters& counters) {
  while (true) {
    const Collision hit =
        sampleCollision(medium, flight.origin, flight.direction, flight.length, rng, counters);
    if (hit.happened()) flight.length = hit.distance;
    flight.extinctionAtEnd = hit.extinction;
    batch.add(flight);
    ++stats.flights;
    if (!hit.happened()) {
      stats.escaped += Vec3d(flight.power);
      return;
    }
    const Vec3d before(flight.power);
    const Vec3f point = flight.origin + flight.direction * hit.distance;
    ScatterEvent event = scatter(medium, point, flight.direction, rng);
    if (!event.survived) {
      stats.absorbed += before;
      return;
    }
    flight.power *= event.weight;
    stats.absorbed += before - Vec3d(flight.power);
    ++stats.scatterings;
    ++flight.scatterings;
    ++flight.ordinal;
    if (flight.scatterings > kLongPath) {
      const Vec3d whole(flight.power);
      if (!(rng.uniform() < 0.999f)) {
        stats.cappedPower += whole;
        ++stats.capped;
        return;
      }
      flight.power *= 1.0f / 0.999f;
      stats.cappedPower += whole - Vec3d(flight.power);
    }
    flight.origin = point;
    flight.direction = event.direction;
    flight.length = exitDistance(medium, point, flight.direction);
  }
}

}  // namespace

lights::BoundingSphere boundingSphere(const Medium& medium) {
  if (medium.bounds().empty()) return {Vec3d(0.0), 0.0};
  return {medium.bounds().center(), 0.5 * glm::length(medium.bounds().extent()) * (1 + 1e-6)};
}

TraceStatistics tracePhotons(const Medium& medium, const LightList& lights,
                             const TraceOptions& options, FlightSink& sink) {
  TraceStatistics total;
  const lights::BoundingSphere bounds = boundingSphere(medium);
  if (!(bounds.radius > 0) || lights.empty()) return total;
  const LightChoice choice(lights, bounds);
  if (choice.dark()) return total;
  const std::uint64_t first = std::min(options.firstPhoton, options.photons);
  const std::uint64_t count = std::min(options.photonCount, options.photons - first);
  const BirthSequence births(options.key);
  const std::uint64_t chunks = (count + kPhotonsPerChunk - 1) / kPhotonsPerChunk;
  std::vector<TraceStatistics> parts(chunks);
  Progress progress("trace", count);

  parallelFor(chunks, 1, [&](std::size_t beginChunk, std::size_t endChunk) {
    for (std::size_t chunk = beginChunk; chunk < endChunk; ++chunk) {
      TraceStatistics& stats = parts[chunk];
      TrackingCounters counters;
      Batch batch(sink);
      const std::uint64_t begin = first + chunk * kPhotonsPerChunk;
      const std::uint64_t end = std::min(begin + kPhotonsPerChunk, first + count);
      for (std::uint64_t photon = begin; photon < end; ++photon) {
        Rng rng(options.key, RandomStream::photon, photon);
        const std::size_t light = choice.choose(births(photon, 0));
        const lights::Emission birth = lights[light]->emit(
            bounds,
            Vec4f(births(photon, 1), births(photon, 2), births(photon, 3), births(photon, 4)));
        Flight flight;
        flight.power = birth.power / static_cast<float>(choice.probability(light));
        flight.photon = photon;
        flight.light = static_cast<std::uint32_t>(light);
        ++stats.photons;
        stats.emitted += Vec3d(flight.power);
        const Segment inside = clipToMedium(medium, birth.origin, birth.direction,
                                            std::numeric_limits<double>::infinity());
        if (!(inside.length > 0.0f)) {
          stats.missed += Vec3d(flight.power);
          continue;
        }
        flight.origin = inside.origin;
        flight.direction = inside.direction;
        flight.length = inside.length;
        follow(medium, flight, rng, batch, stats, counters);
      }
      stats.majorantViolations += counters.majorantViolations;
      progress.add(end - begin);
    }
  });
  for (const TraceStatistics& part : parts)
    accumulate(total, part);
  const double scale = options.photons > 0 ? 1.0 / static_cast<double>(options.photons) : 0.0;
  for (Vec3d* power :
       {&total.emitted, &total.missed, &total.absorbed, &total.escaped, &total.cappedPower})
    *power *= scale;
  return total;
}

}  // namespace photosphere::transport
