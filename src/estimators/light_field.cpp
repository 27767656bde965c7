#include "photosphere/estimators/light_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "deposit.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/core/parallel.h"
#include "voxel_lookup.h"

namespace photosphere::estimators {

using transport::Medium;

namespace {

// Crossings in the ball of the automatic radius. Set on a sphere, a fractal plume and the shipped
// column, 2026-11-22: half of it is noisier, twice as much is darker at the smoke's edge.
constexpr double kWantedCrossings = 2000.0;

void checkSums(const FixedSums& sums) {
  if (sums.overflows > 0)
    throw Error(
        ExitCode::unspecified,
        fmt::format("{} photon deposits overflowed their 64-bit sums; lower estimator.photons "
                    "or raise estimator.light_voxel",
                    sums.overflows.load()));
}

std::vector<float> toFloats(const FixedSums& sums, double scale) {
  std::vector<float> values(sums.sums.size());
  parallelFor(values.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      values[i] = static_cast<float>(static_cast<double>(sums.sums[i]) * sums.quantum * scale);
  });
  return values;
}

int marginOf(const LightFieldLayout& layout, double edge) {
  return static_cast<int>(std::ceil(layout.radius / edge)) + 1;
}

// Fluence on voxels, whatever the final carrier is.
void traceVoxels(const Medium& medium, const transport::LightList& lights, const View& view,
                 const transport::TraceOptions& options, transport::TraceStatistics& statistics,
                 LightField& field) {
  const double edge = field.layout.lightVoxel * medium.voxelEdge();
  std::function<bool(const Vec3d&)> seen;
  // Two blurs and a reading between voxels; three radii, as a wider kernel may ask again.
  const double reach = 3.0 * field.layout.radius + 3.0 * edge;
  if (!view.planes.empty()) seen = [&](const Vec3d& p) { return view.sees(p, reach); };
  field.lattice = transport::SupportLattice(medium, edge, marginOf(field.layout, edge), seen);
  FixedSums sums;
  sums.sums.assign(field.lattice.size() * static_cast<std::size_t>(field.layout.valuesPerCarrier()),
                   0);
  // The quantum is fixed by the scene (METHOD.md section 6): its power times the smoke's diameter.
  const double power = transport::sharedPower(medium, lights);
  const double diameter = 2.0 * transport::boundingSphere(medium).radius;
  sums.quantum = power > 0 && diameter > 0 ? power * diameter * 0x1p-24 : 1.0;
  VoxelSink sink(CarrierSums(medium, lights, field.layout, view, options.key, sums),
                 field.layout.deposit, field.lattice);
  statistics = transport::tracePhotons(medium, lights, options, sink);
  checkSums(sums);
  const double volume = edge * edge * edge;
  field.values = toFloats(
      sums, 1.0 / (static_cast<double>(std::max<std::uint64_t>(1, options.photons)) * volume));
}

void traceCollisionsOnParticles(const Medium& medium, const transport::LightList& lights,
                                const View& view, const transport::TraceOptions& options,
                                transport::TraceStatistics& statistics, LightField& field) {
  FixedSums sums;
  sums.sums.assign(
      field.particles.size() * static_cast<std::size_t>(field.layout.valuesPerCarrier()), 0);
  const double power = transport::sharedPower(medium, lights);
  sums.quantum = power > 0 ? power * 0x1p-24 : 1.0;
  const ParticleIndex index(field.particles, field.layout.depositRadius);
  ParticleSink sink(CarrierSums(medium, lights, field.layout, view, options.key, sums),
                    field.layout, field.particles, index);
  statistics = transport::tracePhotons(medium, lights, options, sink);
  checkSums(sums);
  field.farPhotons = sink.farPhotons();
  field.values =
      toFloats(sums, 1.0 / static_cast<double>(std::max<std::uint64_t>(1, options.photons)));
}

}  // namespace

double automaticRadius(const Medium& medium, const LightFieldLayout& layout,
                       std::uint64_t photons) {
  if (medium.bounds().empty()) return 0.0;
  const double edge = layout.lightVoxel * medium.voxelEdge();
  const Vec3d cells = glm::max(medium.bounds().extent() / edge, Vec3d(1.0));
  const double voxels = cells.x * cells.y * cells.z;
  // Crossings of one voxel if photons filled the box evenly, each crossing it about twice.
  const double crossings =
      std::max(1e-6, 2.0 * static_cast<double>(std::max<std::uint64_t>(1, photons)) *
                         std::cbrt(voxels) / voxels);
  const double radius = edge * std::cbrt(kWantedCrossings / (crossings * 4.0 / 3.0 * kPi));
  // Less than a voxel smooths nothing; beyond four the picture is mush whatever the noise.
  return std::clamp(radius, 0.5 * edge, 4.0 * edge);
}

LightField traceLightField(const Medium& medium, const transport::LightList& lights,
                           const LightFieldLayout& layout, const View& view,
                           const std::vector<Vec3f>& particles,
                           const transport::TraceOptions& options,
                           transport::TraceStatistics& statistics) {
  checkLayout(layout);
  LightField field;
  field.layout = layout;
  field.photons = options.photons;
  if (layout.carrier == Carrier::particles) {
    if (particles.empty())
      throw ConfigError(
          "estimator.carrier = \"particles\": the volume has no particles; `photosphere "
          "convert` seeds them in a grid, or use carrier = \"voxels\"");
    field.particles = particles;
  }
  if (layout.holdsPower()) {
    traceCollisionsOnParticles(medium, lights, view, options, statistics, field);
    return field;
  }
  traceVoxels(medium, lights, view, options, statistics, field);
  if (layout.carrier == Carrier::particles) {
    // Track lengths are gathered on voxels and read off at the particles (METHOD.md section 5.4).
    field.values = sampleAtParticles(field, field.particles);
    field.lattice = {};
  }
  return field;
}

}  // namespace photosphere::estimators
