#include "photosphere/render/shadows.h"

#include "light_depth.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"

namespace photosphere::render {

using transport::Medium;
using transport::Segment;
using Field = volume::BrickField<float>;

namespace {

// True when one of the eight voxels around a node holds smoke.
bool besideSmoke(const transport::SupportLattice& lattice, const Vec3i& node) {
  for (int corner = 0; corner < 8; ++corner)
    if (lattice.number(node - Vec3i(corner & 1, corner >> 1 & 1, corner >> 2)) >= 0) return true;
  return false;
}

}  // namespace

Shadows::Shadows(const Medium& medium, const transport::LightList& lights, ShadowMode mode,
                 float step, std::uint64_t budgetBytes)
    : m_medium(&medium),
      m_mode(mode),
      m_step(step),
      m_depths(lights.size()),
      m_tables(lights.size()) {
  if (mode != ShadowMode::grid || medium.bounds().empty()) return;
  std::optional<transport::SupportLattice> lattice;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (!lights[i]->isDelta()) continue;
    std::optional<LightDepth> depth = LightDepth::plan(medium, *lights[i]);
    if (!depth && !lattice) lattice.emplace(medium, medium.voxelEdge(), 0);
    const std::uint64_t bytes =
        depth ? depth->predictedBytes()
              : lattice->activeBricks().size() * Field::kBrickSize * sizeof(float);
    if (budgetBytes && memoryBytes() + bytes > budgetBytes) {
      log::warning(
          "light '{}': its shadow grid of {} passes the memory budget; its shadows are marched "
          "instead (render.shadow = \"march\"), which is slower",
          lights[i]->name(), formatBytes(bytes));
      continue;
    }
    if (depth) {
      depth->fill(medium, step);
      m_depths[i] = std::make_unique<LightDepth>(std::move(*depth));
    } else {
      m_tables[i] = uprightTable(*lights[i], *lattice);
    }
  }
}

Shadows::~Shadows() = default;

Shadows::Table Shadows::uprightTable(const lights::Light& light,
                                     const transport::SupportLattice& lattice) const {
  const double pitch = lattice.edge();
  auto fetch = [&](const Vec3i& brick, float* depth) {
    bool lit = false;
    for (int z = 0; z < Field::kNodes; ++z)
      for (int y = 0; y < Field::kNodes; ++y)
        for (int x = 0; x < Field::kNodes; ++x) {
          const Vec3i node = brick * 8 + Vec3i(x, y, z);
          if (!besideSmoke(lattice, node)) {
            *depth++ = 0.0f;  // no lookup in smoke reads this node
            continue;
          }
          const Vec3d p = lattice.origin() + Vec3d(node) * pitch;
          const lights::Illumination in = light.illuminate(Vec3f(p), Vec2f(0.5f));
          lit = lit || maxComponent(in.irradiance) > 0.0f;
          const Segment toLight = transport::clipToMedium(*m_medium, p, -in.direction,
                                                          static_cast<double>(in.distance));
          *depth++ = toLight.length > 0.0f
                         ? transport::marchOpticalDepth(*m_medium, toLight.origin,
                                                        toLight.direction, toLight.length, m_step)
                         : 0.0f;
        }
    // No node of this brick sees the lamp, so nothing in it is ever looked up with a weight.
    if (!lit) std::fill_n(depth - Field::kBrickSize, Field::kBrickSize, 0.0f);
  };
  return {Field(Vec3i(0), lattice.bricks(), lattice.activeBricks(), fetch), Vec3f(lattice.origin()),
          static_cast<float>(1.0 / pitch)};
}

float Shadows::transmittance(std::size_t light, const Vec3f& p, const Vec3f& direction,
                             float distance, Rng& rng,
                             transport::TrackingCounters& counters) const {
  // The optical depth is interpolated, not the transmittance: it is linear where smoke is even.
  if (const auto& depth = m_depths[light]) return fastExp(-depth->at(p));
  if (const std::optional<Table>& table = m_tables[light])
    return fastExp(-table->opticalDepth.sample((p - table->origin) * table->inversePitch));
  const Segment toLight =
      transport::clipToMedium(*m_medium, Vec3d(p), -direction, static_cast<double>(distance));
  if (!(toLight.length > 0.0f)) return 1.0f;
  if (m_mode == ShadowMode::track)
    return transport::trackTransmittance(*m_medium, toLight.origin, toLight.direction,
                                         toLight.length, rng, counters);
  return fastExp(-transport::marchOpticalDepth(*m_medium, toLight.origin, toLight.direction,
                                               toLight.length, m_step));
}

std::uint64_t Shadows::memoryBytes() const {
  std::uint64_t bytes = 0;
  for (const auto& depth : m_depths)
    if (depth) bytes += depth->memoryBytes();
  for (const auto& table : m_tables)
    if (table) bytes += table->opticalDepth.memoryBytes();
  return bytes;
}

}  // namespace photosphere::render
