#include "photosphere/estimators/photon_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "cell_grid.h"
#include "deposit.h"
#include "photosphere/core/error.h"
#include "photosphere/core/parallel.h"
#include "photosphere/estimators/photon_set.h"

namespace photosphere::estimators {

using transport::Coefficients;
using transport::Flight;
using transport::Medium;

namespace {

// Photons in the ball of the automatic radius where the mean photon is.
constexpr double kWantedPhotons = 60.0;
// Edge of the cells that a forecast measures densities in [density voxels].
constexpr double kForecastCell = 4.0;
// Photons that a forecast traces.
constexpr std::uint64_t kForecastPhotons = 16384;
constexpr std::uint64_t kMostPhotons = 0xfffffff0u;
// Radius over the smoke's extent at least: float positions resolve nothing below it.
constexpr double kSmallestRadius = 1e-6;

// Photons that a trace emits.
std::uint64_t countOf(const transport::TraceOptions& options) {
  return std::min(options.photonCount,
                  options.photons - std::min(options.firstPhoton, options.photons));
}

// Keeps the collisions of flights, batch by batch.
class CollisionSink final : public transport::FlightSink {
 public:
  CollisionSink(const transport::LightList& lights, int channels, bool unscattered)
      : m_channels(channels), m_wantsUnscattered(wantsUnscattered(lights, unscattered)) {}

  void consume(std::span<const Flight> flights) override {
    Batch batches[2];
    for (const Flight& flight : flights) {
      const int set = setOf(flight, m_wantsUnscattered);
      if (set >= 0 && flight.collided()) append(flight, batches[set]);
    }
    const std::lock_guard lock(m_mutex);
    for (std::size_t set = 0; set < 2; ++set) {
      if (batches[set].values.empty()) continue;
      m_counts[set] += batches[set].values.size() / stride();
      if (m_counts[set] > kMostPhotons)
        throw MemoryError(
            "a photon map holds at most 4 billion photons; lower estimator.photons "
            "or use estimator.passes");
      m_batches[set].push_back(std::move(batches[set]));
    }
  }

  // One set's photons in the order of their numbers, whatever the order of the batches: every
  // batch is of consecutive photons. Empties the set.
  PhotonColumns take(std::size_t set) {
    std::vector<Batch> batches = std::move(m_batches[set]);
    std::sort(batches.begin(), batches.end(), [](const Batch& a, const Batch& b) {
      return std::pair(a.photon, a.ordinal) < std::pair(b.photon, b.ordinal);
    });
    PhotonColumns photons(static_cast<std::size_t>(m_counts[set]), m_channels);
    std::size_t next = 0;
    for (Batch& batch : batches) {
      for (const float* v = batch.values.data(); v != batch.values.data() + batch.values.size();
           v += stride(), ++next) {
        for (std::size_t a = 0; a < 3; ++a) {
          photons.position[a][next] = v[a];
          photons.direction[a][next] = v[3 + a];
        }
        for (int c = 0; c < m_channels; ++c)
          photons.power[static_cast<std::size_t>(c)][next] = v[6 + c];
      }
      batch.values = {};
    }
    return photons;
  }

 private:
  struct Batch {
    std::uint64_t photon = 0;
    std::uint32_t ordinal = 0;  // of the first photon kept
    std::vector<float> values;  // position, direction, power of each
  };

  std::size_t stride() const { return 6 + static_cast<std::size_t>(m_channels); }

  void append(const Flight& flight, Batch& batch) const {
    if (batch.values.empty()) {
      batch.photon = flight.photon;
      batch.ordinal = flight.ordinal;
    }
    const Vec3f p = flight.origin + flight.direction * flight.length;
    const Vec3f& d = flight.direction;
    batch.values.insert(batch.values.end(), {p.x, p.y, p.z, d.x, d.y, d.z});
    const Rgb power = flight.collisionPower();
    batch.values.insert(batch.values.end(), &power.x, &power.x + m_channels);
  }

  int m_channels;
  std::vector<bool> m_wantsUnscattered;
  std::mutex m_mutex;
  std::vector<Batch> m_batches[2];
  std::uint64_t m_counts[2] = {0, 0};
};

// What is not one Henyey-Greenstein lobe is quicker to read from a table.
Lobe lobeOf(const phase::PhaseFunction& phase, const sphere::SmoothingKernel& kernel) {
  return kernel.acts() || !phase.plain() ? tabulatedLobe(phase, kernel) : Lobe{phase, nullptr};
}

std::unique_ptr<PhotonSet> makeSet(const PhotonColumns& photons, const PhotonMapLayout& layout) {
  return layout.neighbors > 0
             ? makeNearestSet(photons, layout.kernel, layout.neighbors, layout.radius)
             : makeFixedRadiusSet(photons, layout.kernel, layout.radius);
}

class Map final : public PhotonMap {
 public:
  Map(const Medium& medium, const PhotonMapLayout& layout, std::uint64_t emitted,
      CollisionSink& sink)
      : m_perPhoton(1.0f / static_cast<float>(std::max<std::uint64_t>(1, emitted))) {
    PhotonMapLayout usable = layout;
    usable.radius =
        std::max(layout.radius, kSmallestRadius * maxComponent(medium.bounds().extent()));
    m_sets.push_back(makeSet(sink.take(0), usable));
    if (layout.unscattered) m_sets.push_back(makeSet(sink.take(1), usable));
    for (const phase::PhaseFunction& phase : medium.phases())
      m_lobes.push_back(lobeOf(phase, layout.directionKernel));
  }

  Inscatter at(const Vec3f& p, const Vec3f& wo, const Coefficients& c) const override {
    Inscatter result;
    if (!(c.extinction > 0.0f)) return result;
    for (std::size_t k = 0; k < m_lobes.size(); ++k) {
      const Rgb albedo = c.scattering[k] * (m_perPhoton / c.extinction);
      result.multiple += albedo * m_sets[0]->scattered(p, wo, m_lobes[k]);
      if (m_sets.size() > 1) result.single += albedo * m_sets[1]->scattered(p, wo, m_lobes[k]);
    }
    return result;
  }
  bool carriesUnscattered() const override { return m_sets.size() > 1; }

  std::uint64_t photons() const override {
    std::uint64_t sum = 0;
    for (const auto& set : m_sets)
      sum += set->photons().count;
    return sum;
  }
  std::uint64_t memoryBytes() const override {
    std::uint64_t sum = 0;
    for (const auto& set : m_sets)
      sum += set->memoryBytes();
    return sum;
  }

 private:
  float m_perPhoton;  // the tracer gives every photon the whole power
  std::vector<std::unique_ptr<PhotonSet>> m_sets;
  std::vector<Lobe> m_lobes;
};

}  // namespace

std::unique_ptr<PhotonMap> tracePhotonMap(const Medium& medium, const transport::LightList& lights,
                                          const PhotonMapLayout& layout,
                                          const transport::TraceOptions& options,
                                          transport::TraceStatistics& statistics) {
  CollisionSink sink(lights, layout.channels, layout.unscattered);
  statistics = transport::tracePhotons(medium, lights, options, sink);
  return std::make_unique<Map>(medium, layout, countOf(options), sink);
}

PhotonForecast forecastPhotons(const Medium& medium, const transport::LightList& lights,
                               bool unscattered, const transport::TraceOptions& options) {
  const std::uint64_t count = countOf(options);
  transport::TraceOptions few = options;
  few.photonCount = std::min(count, kForecastPhotons);
  CollisionSink sink(lights, 1, unscattered);
  transport::tracePhotons(medium, lights, few, sink);
  std::vector<Vec3f> positions = sink.take(0).positions();
  const std::vector<Vec3f> unscatteredPositions = sink.take(1).positions();
  positions.insert(positions.end(), unscatteredPositions.begin(), unscatteredPositions.end());

  PhotonForecast forecast;
  const auto found = static_cast<double>(positions.size());
  forecast.photons =
      static_cast<std::uint64_t>(found * static_cast<double>(count) /
                                 static_cast<double>(std::max<std::uint64_t>(1, few.photonCount)));
  if (positions.empty()) return forecast;
  // Pairs that share a cell measure the integral of the squared density, whatever their number.
  const CellGrid cells(positions, kForecastCell * medium.voxelEdge());
  double pairs = 0;
  for (const Vec3f& p : positions) {
    const Vec3i c = glm::clamp(cells.cellOf(p), Vec3i(0), cells.dimensions() - 1);
    pairs += static_cast<double>(cells.cellEnd(c) - cells.cellBegin(c) - 1);
  }
  const double edge = static_cast<double>(cells.edge());
  forecast.volume = found * (found - 1) * edge * edge * edge / std::max(1.0, pairs);
  return forecast;
}

std::uint64_t photonMapBytes(const PhotonMapLayout& layout, std::uint64_t photons) {
  const std::uint64_t columns = PhotonColumns::bytesOf(layout.channels);
  // Built: photons as they were kept and their copy in order, the order itself, and either cells
  // (at most four a photon) with a copy of the positions, or the nodes of the tree.
  return photons * (2 * columns + (layout.neighbors > 0 ? 16 : 4 + 16 + 12));
}

double automaticRadius(const Medium& medium, const PhotonForecast& forecast) {
  const double voxel = medium.voxelEdge();
  const double ball = kWantedPhotons * forecast.volume /
                      static_cast<double>(std::max<std::uint64_t>(1, forecast.photons));
  return std::clamp(std::cbrt(ball / (4.0 / 3.0 * kPi)), 0.25 * voxel, 8.0 * voxel);
}

double progressiveRadiusFactor(int pass) {
  double volume = 1.0;
  for (int i = 1; i <= pass; ++i)
    volume *= (i + 2.0 / 3.0) / (i + 1.0);
  return std::cbrt(volume);
}

}  // namespace photosphere::estimators
