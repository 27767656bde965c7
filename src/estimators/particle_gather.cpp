#include "particle_gather.h"

#include <algorithm>

#include "photosphere/core/parallel.h"

namespace photosphere::estimators {

ParticleGather::ParticleGather(const LightField& field, const transport::Medium& medium)
    : m_field(field),
      m_index(field.particles, std::max(field.layout.radius, 1e-12)),
      m_radius(static_cast<float>(std::max(field.layout.radius, 1e-12))) {
  const LightFieldLayout& layout = field.layout;
  const double r =
      std::max(layout.energy == EnergyRule::gather ? layout.depositRadius : layout.radius, 1e-12);
  m_ballVolume = static_cast<float>(4.0 / 3.0 * kPi * r * r * r);
  if (layout.holdsPower()) return;
  float largest = 0.0f;
  for (const Vec3f& p : field.particles) {
    m_extinction.push_back(medium.extinction(p));
    largest = std::max(largest, m_extinction.back());
  }
  for (float& e : m_extinction)
    e = std::max(e, 1e-3f * largest + 1e-30f);
}

bool ParticleGather::around(const Vec3f& p, std::vector<Part>& parts) const {
  const LightFieldLayout& layout = m_field.layout;
  const bool power = layout.holdsPower();
  const bool scatter = power && layout.energy == EnergyRule::scatter;
  parts.clear();
  float natural = 0.0f, even = 0.0f;
  m_index.forEachWithin(p, m_radius, [&](std::size_t particle, float squared) {
    const float w = scatter ? 1.0f : kernelWeight(layout.kernel, squared / (m_radius * m_radius));
    if (!(w > 0.0f)) return;
    parts.push_back({particle, w});
    natural += w;
    if (!power) even += w / m_extinction[particle];
  });
  if (parts.empty()) return false;
  if (power) {
    const float scale = 1.0f / (scatter ? m_ballVolume : natural * m_ballVolume);
    for (Part& part : parts)
      part.weight *= scale;
    return true;
  }
  const float own = 0.5f / natural, evened = 0.5f / even;
  for (Part& part : parts)
    part.weight *= own + evened / m_extinction[part.particle];
  return true;
}

Colours ParticleGather::atVoxels(const transport::SupportLattice& lattice,
                                 const Colours& colours) const {
  Colours out(lattice.size(), Vec4f(0.0f));
  std::vector<std::uint8_t> reached(lattice.size(), 0);
  parallelFor(out.size(), 256, [&](std::size_t begin, std::size_t end) {
    std::vector<Part> parts;
    for (std::size_t i = begin; i < end; ++i) {
      if (!around(lattice.center(i), parts)) continue;
      reached[i] = 1;
      for (const Part& part : parts)
        out[i] += part.weight * colours[part.particle];
    }
  });
  if (!m_field.layout.holdsPower()) fillUnreached(lattice, out, reached);
  return out;
}

}  // namespace photosphere::estimators
