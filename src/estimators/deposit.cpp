#include "deposit.h"

#include <algorithm>

#include "photosphere/core/fixed_point.h"

namespace photosphere::estimators {

using transport::Flight;

std::vector<bool> wantsUnscattered(const transport::LightList& lights, bool unscattered) {
  std::vector<bool> wants;
  for (const auto& light : lights)
    wants.push_back(unscattered && !light->isDelta());
  return wants;
}

int setOf(const Flight& flight, const std::vector<bool>& wantsUnscattered) {
  if (flight.scatterings > 0) return 0;
  return wantsUnscattered[flight.light] ? 1 : -1;
}

void FixedSums::add(std::size_t at, double value, std::uint32_t bits) {
  const double units = value / quantum;
  if (!(units < 4e18)) {
    overflows.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  const std::int64_t whole = quantize(units, 1.0, bits);
  if (whole != 0 && !addChecked(sums[at], whole)) overflows.fetch_add(1, std::memory_order_relaxed);
}

std::uint32_t roundingBits(RandomKey key, std::uint64_t photon, std::uint32_t flight,
                           std::uint32_t deposit) {
  // A hash is enough here: the bits only decide the direction of rounding (murmur3's finaliser).
  std::uint64_t h = photon * 0x9e3779b97f4a7c15ull ^
                    (static_cast<std::uint64_t>(flight) << 32 | deposit) ^
                    (static_cast<std::uint64_t>(key.hi) << 32 | key.lo);
  h ^= h >> 33;
  h *= 0xff51afd7ed558ccdull;
  h ^= h >> 33;
  h *= 0xc4ceb9fe1a85ec53ull;
  return static_cast<std::uint32_t>(h >> 32);
}

VoxelSink::VoxelSink(const transport::Medium& medium, const transport::LightList& lights,
                     const LightFieldLayout& layout, const View& view,
                     const transport::SupportLattice& lattice, RandomKey key, FixedSums& sums)
    : m_medium(medium),
      m_layout(layout),
      m_view(view),
      m_lattice(lattice),
      m_key(key),
      m_sums(sums),
      m_partition(layout.rows),
      m_wantsUnscattered(wantsUnscattered(lights, layout.unscattered)) {}

void VoxelSink::consume(std::span<const Flight> flights) {
  for (const Flight& flight : flights) {
    const int set = setOf(flight, m_wantsUnscattered);
    if (set < 0) continue;
    if (m_layout.deposit == Deposit::trackLength)
      depositTrack(flight, static_cast<std::size_t>(set));
    else if (flight.collided())
      depositCollision(flight, static_cast<std::size_t>(set));
  }
}

void VoxelSink::depositTrack(const Flight& flight, std::size_t set) const {
  const int bin = m_layout.basis == Basis::histogram ? m_partition.index(flight.direction) : 0;
  const std::size_t stride = static_cast<std::size_t>(m_layout.valuesPerCarrier());
  const std::size_t offset = set * static_cast<std::size_t>(m_layout.setSize());
  std::uint32_t counter = 0;
  m_lattice.walk(flight.origin, flight.direction, flight.length,
                 [&](std::size_t voxel, float entry, float length) {
                   const Vec3f middle = flight.origin + flight.direction * (entry + 0.5f * length);
                   add(flight, voxel * stride + offset, flight.power * length, middle, bin,
                       counter);
                 });
}

void VoxelSink::depositCollision(const Flight& flight, std::size_t set) const {
  const Vec3f p = flight.origin + flight.direction * flight.length;
  const Vec3d cell = (Vec3d(p) - m_lattice.origin()) / m_lattice.edge();
  const std::int32_t voxel = m_lattice.number(Vec3i(glm::floor(cell)));
  if (voxel < 0) return;
  const int bin = m_layout.basis == Basis::histogram ? m_partition.index(flight.direction) : 0;
  std::uint32_t counter = 0;
  add(flight,
      static_cast<std::size_t>(voxel) * static_cast<std::size_t>(m_layout.valuesPerCarrier()) +
          set * static_cast<std::size_t>(m_layout.setSize()),
      flight.power / flight.extinctionAtEnd, p, bin, counter);
}

void VoxelSink::add(const Flight& flight, std::size_t base, const Rgb& powerLength, const Vec3f& at,
                    int bin, std::uint32_t& counter) const {
  const int channels = m_layout.channels;
  if (m_layout.basis == Basis::histogram) {
    for (int c = 0; c < channels; ++c)
      m_sums.add(base + static_cast<std::size_t>(bin * channels + c),
                 static_cast<double>(powerLength[c]),
                 roundingBits(m_key, flight.photon, flight.ordinal, counter++));
    return;
  }
  const Vec3f toEye = m_view.toEye(at);
  const auto& phases = m_medium.phases();
  for (int k = 0; k < m_layout.phases; ++k) {
    const float f = phases[static_cast<std::size_t>(k)].evaluate(flight.direction, toEye);
    for (int c = 0; c < channels; ++c)
      m_sums.add(base + static_cast<std::size_t>(k * channels + c),
                 static_cast<double>(powerLength[c]) * static_cast<double>(f),
                 roundingBits(m_key, flight.photon, flight.ordinal, counter++));
  }
}

ParticleIndex::ParticleIndex(const std::vector<Vec3f>& positions, double cellEdge)
    : m_grid(positions, cellEdge) {
  m_positions.reserve(positions.size());
  for (const std::uint32_t i : m_grid.order())
    m_positions.push_back(positions[i]);
}

std::size_t ParticleIndex::nearest(const Vec3f& p) const {
  std::size_t best = 0;
  float bestDistance = kInfinity;
  const Vec3i dims = m_grid.dimensions();
  const Vec3i c = glm::clamp(m_grid.cellOf(p), Vec3i(0), dims - 1);
  const int rings = std::max(dims.x, std::max(dims.y, dims.z));
  for (int ring = 0; ring <= rings; ++ring) {
    for (int z = std::max(0, c.z - ring); z <= std::min(c.z + ring, dims.z - 1); ++z)
      for (int y = std::max(0, c.y - ring); y <= std::min(c.y + ring, dims.y - 1); ++y)
        for (int x = std::max(0, c.x - ring); x <= std::min(c.x + ring, dims.x - 1); ++x) {
          if (std::max(std::abs(x - c.x), std::max(std::abs(y - c.y), std::abs(z - c.z))) != ring)
            continue;
          const std::uint32_t end = m_grid.cellEnd({x, y, z});
          for (std::uint32_t i = m_grid.cellBegin({x, y, z}); i < end; ++i) {
            const Vec3f d = m_positions[i] - p;
            const float distance = glm::dot(d, d);
            const std::uint32_t particle = m_grid.order()[i];
            if (distance < bestDistance || (distance == bestDistance && particle < best)) {
              bestDistance = distance;
              best = particle;
            }
          }
        }
    // Clamping to the box of cells brings no particle nearer than it is, so whatever lies beyond
    // this ring is at least `ring` cells away.
    const float reach = static_cast<float>(ring) * m_grid.edge();
    if (bestDistance <= reach * reach) break;
  }
  return best;
}

ParticleSink::ParticleSink(const transport::Medium& medium, const transport::LightList& lights,
                           const LightFieldLayout& layout, const View& view,
                           const std::vector<Vec3f>& positions, const ParticleIndex& index,
                           RandomKey key, FixedSums& sums)
    : m_medium(medium),
      m_layout(layout),
      m_view(view),
      m_positions(positions),
      m_index(index),
      m_key(key),
      m_sums(sums),
      m_partition(layout.rows),
      m_wantsUnscattered(wantsUnscattered(lights, layout.unscattered)) {}

void ParticleSink::consume(std::span<const Flight> flights) {
  std::vector<std::pair<std::size_t, float>> scratch;
  for (const Flight& flight : flights) {
    const int set = setOf(flight, m_wantsUnscattered);
    if (set >= 0 && flight.collided()) deposit(flight, static_cast<std::size_t>(set), scratch);
  }
}

void ParticleSink::deposit(const Flight& flight, std::size_t set,
                           std::vector<std::pair<std::size_t, float>>& scratch) {
  const Vec3f p = flight.origin + flight.direction * flight.length;
  const auto radius = static_cast<float>(m_layout.depositRadius);
  scratch.clear();
  float sum = 0.0f;
  m_index.forEachWithin(p, radius, [&](std::size_t particle, float squared) {
    const float w = m_layout.energy == EnergyRule::gather
                        ? 1.0f
                        : kernelWeight(m_layout.kernel, squared / (radius * radius));
    scratch.emplace_back(particle, w);
    sum += w;
  });
  if (scratch.empty() || !(sum > 0.0f)) {
    m_far.fetch_add(1, std::memory_order_relaxed);
    scratch.assign(1, {m_index.nearest(p), 1.0f});
    sum = 1.0f;
  }
  // Eq. 7a: every particle in range takes the whole power; eq. 7b: they share it.
  const float share = m_layout.energy == EnergyRule::gather ? 1.0f : 1.0f / sum;
  const int bin = m_layout.basis == Basis::histogram ? m_partition.index(flight.direction) : 0;
  const int channels = m_layout.channels;
  std::uint32_t counter = 0;
  for (const auto& target : scratch) {
    const std::size_t base = target.first * static_cast<std::size_t>(m_layout.valuesPerCarrier()) +
                             set * static_cast<std::size_t>(m_layout.setSize());
    const Rgb power = flight.power * (target.second * share);
    const int lobes = m_layout.basis == Basis::histogram ? 1 : m_layout.phases;
    for (int k = 0; k < lobes; ++k) {
      const float f = m_layout.basis == Basis::histogram
                          ? 1.0f
                          : m_medium.phases()[static_cast<std::size_t>(k)].evaluate(
                                flight.direction, m_view.toEye(m_positions[target.first]));
      for (int c = 0; c < channels; ++c)
        m_sums.add(base + static_cast<std::size_t>(
                              (m_layout.basis == Basis::histogram ? bin : k) * channels + c),
                   static_cast<double>(power[c]) * static_cast<double>(f),
                   roundingBits(m_key, flight.photon, flight.ordinal, counter++));
    }
  }
}

}  // namespace photosphere::estimators
