#include "photosphere/transport/photon_tracer.h"

#include <algorithm>
#include <optional>

#include "births.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/parallel.h"
#include "photosphere/core/progress.h"
#include "photosphere/core/resources.h"
#include "photosphere/transport/scatter.h"
#include "photosphere/transport/tracking.h"

namespace photosphere::transport {

namespace {

constexpr std::size_t kBatch = 1024;  // flights handed to the sink at once
constexpr std::uint64_t kPhotonsPerChunk = 4096;

void accumulate(TraceStatistics& sum, const TraceStatistics& part) {
  sum.photons += part.photons;
  sum.born += part.born;
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
    const InterruptShield shield;  // sinks must not throw
    if (!m_flights.empty()) m_sink->consume(m_flights);
    m_flights.clear();
  }
  FlightSink* m_sink;
  std::vector<Flight> m_flights;
};

// Hands a flight on as sinks take it: where the smoke rests.
void handOn(const Medium&, const Flight& flight, Batch& batch, Still) {
  batch.add(flight);
}

// Smoke that moves keeps its light with it (Medium::carrierOf): pieces of a flight are shifted to
// where their smoke lies at the frame's own time. Short ones, as the shift varies along the way;
// the last, to where it ends.
void handOn(const Medium& medium, const Flight& flight, Batch& batch, Moment when) {
  const float longest = 4.0f * static_cast<float>(medium.voxelEdge());
  const int pieces =
      static_cast<int>(std::clamp(std::ceil(flight.length / longest), 1.0f, 4096.0f));
  Flight piece = flight;
  piece.length = flight.length / static_cast<float>(pieces);
  for (int i = 0; i < pieces; ++i) {
    const bool last = i + 1 == pieces;
    piece.origin = flight.origin + flight.direction * (static_cast<float>(i) * piece.length);
    const Vec3f at =
        piece.origin + flight.direction * (last && flight.collided() ? 1.0f : 0.5f) * piece.length;
    piece.origin += medium.carrierOf(at, when) - at;
    piece.extinctionAtEnd = last ? flight.extinctionAtEnd : 0.0f;
    piece.ordinal = flight.ordinal << 12 | static_cast<std::uint32_t>(i);
    batch.add(piece);
  }
}

// Keeps the weights of photons near those that the picture wants: light ones play roulette, heavy
// ones split.
class WeightWindow {
 public:
  /// @param whole  power of a photon that is not steered [W]
  WeightWindow(const PhotonGuide& guide, double whole)
      : m_guide(guide), m_inverseWhole(static_cast<float>(1.0 / whole)) {}

  /// @return how many photons go on in place of one, each of the power that is left in `power`
  int operator()(const Vec3f& p, Rgb& power, Rng& rng) const {
    const float weight = maxComponent(power) * m_inverseWhole;
    const float wanted = m_guide.wantedWeight(p);
    if (weight < 0.5f * wanted) {
      if (!(rng.uniform() * wanted < weight)) return 0;
      power *= wanted / weight;
      return 1;
    }
    if (!(weight > 2.0f * wanted)) return 1;
    const float copies = glm::min(std::ceil(weight / wanted), kMostCopies);
    power /= copies;
    return static_cast<int>(copies);
  }

 private:
  static constexpr float kMostCopies = 64.0f;
  const PhotonGuide& m_guide;
  float m_inverseWhole;
};

// Follows photons from their entry into the bounds to their end.
template <class When>
class Follower {
 public:
  /// @param window  null where photons are not steered
  Follower(const Medium& medium, const WeightWindow* window, Batch& batch, TraceStatistics& stats)
      : m_medium(medium), m_window(window), m_batch(batch), m_stats(stats) {}
  ~Follower() { m_stats.majorantViolations += m_counters.majorantViolations; }
  Follower(const Follower&) = delete;
  Follower& operator=(const Follower&) = delete;

  void follow(Flight flight, Rng& rng, When when) {
    one(flight, rng, when);
    // Those that split off on the way.
    while (!m_waiting.empty()) {
      flight = m_waiting.back();
      m_waiting.pop_back();
      one(flight, rng, when);
    }
  }

 private:
  void one(Flight flight, Rng& rng, When when) {
    while (true) {
      const Collision hit =
          sampleCollisionOf(flight.power, m_medium, flight.origin, flight.direction, flight.length,
                            rng, m_counters, when);
      if (hit.happened()) flight.length = hit.distance;
      flight.extinctionAtEnd = hit.extinction;
      flight.share = hit.share;
      handOn(m_medium, flight, m_batch, when);
      ++m_stats.flights;
      if (!hit.happened()) {
        m_stats.escaped += Vec3d(flight.power);
        return;
      }
      const Vec3d before(flight.power);
      const Vec3f point = flight.origin + flight.direction * hit.distance;
      int copies = 1;
      if (m_window) {
        copies = (*m_window)(point, flight.power, rng);
        m_stats.absorbed += before - static_cast<double>(copies) * Vec3d(flight.power);
      }
      for (; copies > 1; --copies) {
        Flight twin = flight;
        if (scatterAt(twin, point, rng, when)) {
          twin.ordinal += static_cast<std::uint32_t>(copies) << 20;
          m_waiting.push_back(twin);
        }
      }
      if (copies == 0 || !scatterAt(flight, point, rng, when)) return;
    }
  }

  // One collision. @return whether the photon goes on
  bool scatterAt(Flight& flight, const Vec3f& point, Rng& rng, When when) {
    const Vec3d before(flight.power);
    const ScatterEvent event = scatter(m_medium, point, flight.direction, flight.power, rng, when);
    if (!event.survived) {
      m_stats.absorbed += before;
      return false;
    }
    flight.power *= event.weight;
    m_stats.absorbed += before - Vec3d(flight.power);
    m_stats.scatterings += event.scattered ? 1 : 0;
    flight.scatterings += event.scattered ? 1 : 0;
    ++flight.ordinal;
    if (event.scattered && isLongPath(flight.scatterings)) {
      const Vec3d whole(flight.power);
      if (!(rng.uniform() < 0.5f)) {
        m_stats.cappedPower += whole;
        ++m_stats.capped;
        return false;
      }
      flight.power *= 2.0f;
      m_stats.cappedPower += whole - Vec3d(flight.power);
    }
    flight.origin = point;
    flight.direction = event.direction;
    flight.length = exitDistance(m_medium, point, flight.direction);
    return true;
  }

  const Medium& m_medium;
  const WeightWindow* m_window;
  Batch& m_batch;
  TraceStatistics& m_stats;
  TrackingCounters m_counters;
  std::vector<Flight> m_waiting;
};

}  // namespace

lights::BoundingSphere boundingSphere(const Medium& medium) {
  if (medium.bounds().empty()) return {Vec3d(0.0), 0.0};
  return {medium.bounds().center(), 0.5 * glm::length(medium.bounds().extent()) * (1 + 1e-6)};
}

double sharedPower(const Medium& medium, const LightList& lights) {
  return medium.bounds().empty() ? 0.0 : SourceChoice(medium, lights).total();
}

namespace {

// The photons of one chunk: [begin, end).
template <class When>
void traceChunk(const Medium& medium, const Births& births, const FlightTimes& times, RandomKey key,
                const WeightWindow* window, std::uint64_t begin, std::uint64_t end,
                FlightSink& sink, TraceStatistics& stats) {
  Batch batch(sink);
  Follower<When> follower(medium, window, batch, stats);
  for (std::uint64_t photon = begin; photon < end; ++photon) {
    throwIfInterrupted();
    Rng rng(key, RandomStream::photon, photon);
    When when;
    times.of(photon, when);
    const Flight flight = births(photon, rng, when);
    const bool born = flight.light == kEmittedBySmoke;
    ++stats.photons;
    stats.born += born ? 1 : 0;
    stats.emitted += Vec3d(flight.power);
    // What is born at the very edge still leaves from inside.
    if (flight.length > 0.0f || born)
      follower.follow(flight, rng, when);
    else
      stats.missed += Vec3d(flight.power);
  }
}

std::uint64_t chunksOf(std::uint64_t photons) {
  return (photons + kPhotonsPerChunk - 1) / kPhotonsPerChunk;
}

// Chunks that are traced between two pauses: about half a second's.
class SliceLength {
 public:
  explicit SliceLength(bool pauses) : m_chunks(pauses ? 16 : ~0ull) {}
  std::uint64_t chunks() const { return m_chunks; }
  void took(double seconds) {
    if (m_chunks == ~0ull) return;
    const double factor = std::clamp(0.5 / std::max(seconds, 1e-3), 0.25, 4.0);
    m_chunks = std::max<std::uint64_t>(
        1, static_cast<std::uint64_t>(std::min(factor * static_cast<double>(m_chunks), 1e9)));
  }

 private:
  std::uint64_t m_chunks;
};

}  // namespace

TraceStatistics tracePhotons(const Medium& medium, const LightList& lights,
                             const TraceOptions& options, FlightSink& sink) {
  TraceStatistics total;
  if (medium.bounds().empty()) return total;
  const Births births(medium, lights, options);
  if (births.dark()) return total;
  std::optional<WeightWindow> window;
  if (options.guide) window.emplace(*options.guide, SourceChoice(medium, lights).total());
  const FlightTimes times(medium.shutter(), options.key);
  const auto trace = medium.isMoving() ? traceChunk<Moment> : traceChunk<Still>;
  const std::uint64_t first = std::min(options.firstPhoton, options.photons);
  const std::uint64_t count = std::min(options.photonCount, options.photons - first);
  const std::uint64_t chunks = chunksOf(count);
  TraceProgress done = options.begun;
  Progress progress("trace", count);
  progress.add(done.photons);
  std::optional<InterruptDelay> delay;
  if (options.pause) delay.emplace();
  SliceLength slice(options.pause != nullptr);

  for (std::uint64_t next = chunksOf(done.photons); next < chunks;) {
    const std::uint64_t here = std::min(slice.chunks(), chunks - next);
    std::vector<TraceStatistics> parts(here);
    const Stopwatch watch;
    parallelFor(here, 1, [&](std::size_t beginChunk, std::size_t endChunk) {
      for (std::size_t chunk = beginChunk; chunk < endChunk; ++chunk) {
        const std::uint64_t begin = (next + chunk) * kPhotonsPerChunk;
        const std::uint64_t end = std::min(begin + kPhotonsPerChunk, count);
        trace(medium, births, times, options.key, window ? &*window : nullptr, first + begin,
              first + end, sink, parts[chunk]);
        progress.add(end - begin);
      }
    });
    // In the order of the photons, however they are sliced.
    for (const TraceStatistics& part : parts)
      accumulate(done.sums, part);
    next += here;
    done.photons = std::min(next * kPhotonsPerChunk, count);
    slice.took(watch.seconds());
    if (options.pause) options.pause(done);
  }
  total = done.sums;
  const double scale = options.photons > 0 ? 1.0 / static_cast<double>(options.photons) : 0.0;
  for (Vec3d* power :
       {&total.emitted, &total.missed, &total.absorbed, &total.escaped, &total.cappedPower})
    *power *= scale;
  return total;
}

}  // namespace photosphere::transport
