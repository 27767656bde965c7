#include "photosphere/estimators/light_sums.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "deposit.h"
#include "near_eye.h"
#include "photosphere/core/error.h"
#include "photosphere/core/fixed_point.h"
#include "photosphere/core/parallel.h"
#include "photosphere/transport/kept_trace.h"
#include "voxel_lookup.h"

namespace photosphere::estimators {

using transport::Medium;
using transport::TraceStatistics;

namespace {

[[noreturn]] void failOverflow(std::uint64_t times) {
  throw Error(ExitCode::unspecified,
              fmt::format("{} photon deposits overflowed their 64-bit sums; lower "
                          "estimator.photons or raise estimator.light_voxel, or lower the lights' "
                          "intensity where few photons do so",
                          times));
}

int marginOf(const LightFieldLayout& layout, double edge) {
  return static_cast<int>(std::ceil(layout.radius / edge)) + 1;
}

// The quantum is fixed by the scene (METHOD.md section 6): its power, times the smoke's diameter
// where powers are multiplied by lengths.
double quantumOf(const Medium& medium, const transport::LightList& lights, bool power) {
  const double shared = transport::sharedPower(medium, lights);
  const double length = power ? 1.0 : 2.0 * transport::boundingSphere(medium).radius;
  return shared > 0 && length > 0 ? shared * length * 0x1p-24 : 1.0;
}

transport::SupportLattice latticeOf(const Medium& medium, const LightFieldLayout& layout,
                                    const View& view) {
  const double edge = layout.lightVoxel * medium.voxelEdge();
  std::function<bool(const Vec3d&)> seen;
  // Two blurs and a reading between voxels; three radii, as a wider kernel may ask again.
  const double reach = 3.0 * layout.radius + 3.0 * edge;
  if (!view.planes.empty()) seen = [&view, reach](const Vec3d& p) { return view.sees(p, reach); };
  return transport::SupportLattice(medium, edge, marginOf(layout, edge), seen);
}

// One trace into sums, which a checkpoint may hold part of.
class Tracing {
 public:
  Tracing(LightSums& light, Checkpoint* checkpoint, std::uint64_t part)
      : m_light(light), m_checkpoint(checkpoint), m_part(part) {
    m_sums.quantum = light.quantum;
    m_sums.sums.assign(sizeOf(light), 0);
    if (!light.near) return;
    m_near.quantum = light.near->quantum;
    m_near.sums.assign(sizeOf(*light.near), 0);
  }

  TraceStatistics run(const Medium& medium, const transport::LightList& lights, const View& view,
                      const transport::TraceOptions& options) {
    const CarrierSums carriers(medium, lights, m_light.layout, view, options.key, m_sums);
    if (!m_light.layout.holdsPower()) {
      std::optional<VisibleWeight> weight;
      if (m_light.weights) weight.emplace(medium, m_light.lattice, m_light.layout, view);
      VoxelSink sink(carriers, m_light.layout.deposit, m_light.lattice, weight ? &*weight : nullptr,
                     m_light.weights.get());
      if (!m_light.near) return trace(medium, lights, options, sink);
      const LightSums& near = *m_light.near;
      std::optional<VisibleWeight> nearWeight;
      if (near.weights) nearWeight.emplace(medium, near.lattice, m_light.layout, view);
      VoxelSink nearSink(CarrierSums(medium, lights, near.layout, view, options.key, m_near),
                         near.layout.deposit, near.lattice, nearWeight ? &*nearWeight : nullptr,
                         near.weights.get());
      NearEyeSink both(sink, nearSink, near.lattice, view.eye);
      return trace(medium, lights, options, both);
    }
    const ParticleIndex index(m_light.particles, m_light.layout.depositRadius);
    ParticleSink sink(carriers, m_light.layout, m_light.particles, index);
    m_particles = &sink;
    return trace(medium, lights, options, sink);
  }

 private:
  TraceStatistics trace(const Medium& medium, const transport::LightList& lights,
                        const transport::TraceOptions& options, transport::FlightSink& sink) {
    const transport::TraceKeeping keeping{m_checkpoint, m_part, [this](StateWriter& w) { keep(w); },
                                          [this](StateReader& r) { resume(r); }};
    const TraceStatistics statistics =
        transport::tracePhotons(medium, lights, options, sink, keeping);
    if (const std::uint64_t lost = m_sums.overflows + m_near.overflows; lost > 0)
      failOverflow(lost);
    m_light.farPhotons = farPhotons();
    m_light.sums = std::move(m_sums.sums);
    if (m_light.near) m_light.near->sums = std::move(m_near.sums);
    return statistics;
  }

  std::uint64_t farPhotons() const {
    return m_farBefore + (m_particles ? m_particles->farPhotons() : 0);
  }

  void keep(StateWriter& w) const {
    w.value(farPhotons());
    for (const FixedSums* sums : {&m_sums, &m_near}) {
      w.value(sums->overflows.load());
      w.value(sums->sums);
    }
  }
  void resume(StateReader& r) {
    r.value(m_farBefore);
    for (FixedSums* sums : {&m_sums, &m_near}) {
      sums->overflows = r.value<std::uint64_t>();
      const std::size_t size = sums->sums.size();
      r.value(sums->sums);
      if (sums->sums.size() != size) r.fail();
    }
  }
  static std::size_t sizeOf(const LightSums& light) {
    return light.places() * static_cast<std::size_t>(light.layout.valuesPerCarrier());
  }

  LightSums& m_light;
  Checkpoint* m_checkpoint;
  std::uint64_t m_part;
  std::uint64_t m_farBefore = 0;              // of earlier runs
  const ParticleSink* m_particles = nullptr;  // while photons are traced onto particles
  FixedSums m_sums, m_near;
};

// What is kept of directions around an eye in smoke, empty; null where that is not asked for.
std::shared_ptr<LightSums> sumsNearEye(const Medium& medium, const LightSums& light,
                                       const View& view) {
  if (!gathersNearEye(medium, light.layout, view)) return {};
  const std::vector<std::size_t> voxels = voxelsNearEye(light.lattice, light.layout, view);
  if (voxels.empty()) return {};
  auto near = std::make_shared<LightSums>();
  near->layout = nearLayout(light.layout);
  near->lattice = partOf(light.lattice, voxels);
  if (light.weights) {
    auto weights = std::make_shared<std::vector<float>>();
    for (const std::size_t i : voxels)
      weights->push_back((*light.weights)[i]);
    near->weights = std::move(weights);
  }
  near->quantum = light.quantum;
  near->photons = light.photons;
  return near;
}

}  // namespace

LightSums traceLightSums(const Medium& medium, const transport::LightList& lights,
                         const LightFieldLayout& layout, const View& view,
                         const std::vector<Vec3f>& particles,
                         const transport::TraceOptions& options, TraceStatistics& statistics,
                         std::shared_ptr<const std::vector<float>> weights, Checkpoint* checkpoint,
                         std::uint64_t part) {
  checkLayout(layout);
  LightSums light;
  light.layout = layout;
  light.photons = options.photons;
  light.firstPhoton = std::min(options.firstPhoton, options.photons);
  light.photonCount = std::min(options.photonCount, options.photons - light.firstPhoton);
  if (layout.carrier == Carrier::particles) {
    if (particles.empty())
      throw ConfigError(
          "estimator.carrier = \"particles\": the volume has no particles; `photosphere "
          "convert` seeds them in a grid, or use carrier = \"voxels\"");
    light.particles = particles;
  }
  light.quantum = quantumOf(medium, lights, layout.holdsPower());
  if (!layout.holdsPower()) light.lattice = latticeOf(medium, layout, view);
  if (layout.smoothing == Smoothing::visible) {
    light.weights = std::move(weights);
    if (!light.weights || light.weights->size() != light.lattice.size())
      light.weights = visibleWeights(medium, light.lattice, layout, view);
  }
  light.near = sumsNearEye(medium, light, view);
  statistics = Tracing(light, checkpoint, part).run(medium, lights, view, options);
  return light;
}

void addSums(LightSums& into, const LightSums& other) {
  std::atomic<std::uint64_t> overflows{0};
  parallelFor(into.sums.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (!addChecked(into.sums[i], other.sums[i])) ++overflows;
  });
  if (overflows > 0) failOverflow(overflows);
  if (into.near && other.near) addSums(*into.near, *other.near);
  into.photonCount += other.photonCount;
  into.firstPhoton = std::min(into.firstPhoton, other.firstPhoton);
  into.farPhotons += other.farPhotons;
}

LightField toField(LightSums light) {
  LightField field;
  field.layout = light.layout;
  field.lattice = std::move(light.lattice);
  field.particles = std::move(light.particles);
  field.weights = std::move(light.weights);
  field.photons = light.photons;
  field.farPhotons = light.farPhotons;
  if (light.near) field.near = std::make_shared<LightField>(toField(std::move(*light.near)));
  const double edge = field.lattice.edge();
  const double volume = field.layout.holdsPower() ? 1.0 : edge * edge * edge;
  const double worth =
      1.0 / (static_cast<double>(std::max<std::uint64_t>(1, light.photons)) * volume);
  const std::vector<float>* weights = field.weights.get();
  const auto stride = static_cast<std::size_t>(field.layout.valuesPerCarrier());
  field.values.resize(light.sums.size());
  parallelFor(field.values.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double weight = weights ? static_cast<double>((*weights)[i / stride]) : 1.0;
      if (weight > 0)  // nothing was left elsewhere
        field.values[i] =
            static_cast<float>(static_cast<double>(light.sums[i]) * light.quantum * worth / weight);
    }
  });
  light.sums = {};
  if (field.layout.carrier == Carrier::particles && !field.layout.holdsPower()) {
    // Track lengths are gathered on voxels and read off at the particles (METHOD.md section 5.4).
    field.values = sampleAtParticles(field, field.particles);
    field.lattice = {};
    field.layout.smoothing = Smoothing::twicing;
    field.weights.reset();
  }
  return field;
}

}  // namespace photosphere::estimators
