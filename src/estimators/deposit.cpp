#include "deposit.h"

#include <algorithm>

#include "photosphere/core/fixed_point.h"

namespace photosphere::estimators {

using transport::Flight;

namespace {

std::vector<bool> wantsUnscattered(const transport::LightList& lights,
                                   const LightFieldLayout& layout) {
  std::vector<bool> wants;
  for (const auto& light : lights)
    wants.push_back(layout.unscattered && !light->isDelta());
  return wants;
}

// The set a flight belongs to: 0 = light scattered before or emitted by the smoke, which no other
// term carries to its next scattering; 1 = light as its lamp sent it. -1 = none: the lamp's own
// light is evaluated at march time.
int setOf(const Flight& flight, const std::vector<bool>& wantsUnscattered) {
  if (flight.scatterings > 0 || flight.light == transport::kEmittedBySmoke) return 0;
  return wantsUnscattered[flight.light] ? 1 : -1;
}

}  // namespace

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
      m_wantsUnscattered(wantsUnscattered(lights, layout)) {}

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

ParticleIndex::ParticleIndex(const std::vector<Vec3f>& positions, double cellEdge) {
  Box3f box;
  for (const Vec3f& p : positions)
    box.grow(p);
  if (box.empty()) box = {Vec3f(0.0f), Vec3f(0.0f)};
  m_min = box.min;
  // At most about one cell a particle in a full box: a tiny radius must not ask for all memory.
  const Vec3d extent(box.extent());
  double edge = std::max(cellEdge, 1e-30);
  const double limit = 4.0 * static_cast<double>(positions.size()) + 64.0;
  auto cells = [&](int a) { return std::floor(extent[a] / edge) + 1.0; };
  while (cells(0) * cells(1) * cells(2) > limit)
    edge *= 1.5;
  m_edge = static_cast<float>(edge);
  m_inverseEdge = static_cast<float>(1.0 / edge);
  for (int a = 0; a < 3; ++a)
    m_dims[a] = static_cast<int>(cells(a)) + 1;
  m_start.assign(static_cast<std::size_t>(m_dims.x) * static_cast<std::size_t>(m_dims.y) *
                         static_cast<std::size_t>(m_dims.z) +
                     1,
                 0);
  auto clampedCell = [&](const Vec3f& p) { return glm::clamp(cellOf(p), Vec3i(0), m_dims - 1); };
  for (const Vec3f& p : positions)
    ++m_start[index(clampedCell(p)) + 1];
  for (std::size_t i = 1; i < m_start.size(); ++i)
    m_start[i] += m_start[i - 1];
  std::vector<std::uint32_t> next(m_start.begin(), m_start.end() - 1);
  m_original.resize(positions.size());
  m_positions.resize(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const std::uint32_t slot = next[index(clampedCell(positions[i]))]++;
    m_original[slot] = static_cast<std::uint32_t>(i);
    m_positions[slot] = positions[i];
  }
}

Vec3i ParticleIndex::cellOf(const Vec3f& p) const {
  const Vec3f u = glm::clamp((p - m_min) * m_inverseEdge, Vec3f(-1e6f), Vec3f(1e6f));
  return Vec3i(glm::floor(u));
}

std::size_t ParticleIndex::nearest(const Vec3f& p) const {
  std::size_t best = 0;
  float bestDistance = kInfinity;
  const Vec3i c = glm::clamp(cellOf(p), Vec3i(0), m_dims - 1);
  const int rings = std::max(m_dims.x, std::max(m_dims.y, m_dims.z));
  for (int ring = 0; ring <= rings; ++ring) {
    for (int z = std::max(0, c.z - ring); z <= std::min(c.z + ring, m_dims.z - 1); ++z)
      for (int y = std::max(0, c.y - ring); y <= std::min(c.y + ring, m_dims.y - 1); ++y)
        for (int x = std::max(0, c.x - ring); x <= std::min(c.x + ring, m_dims.x - 1); ++x) {
          if (std::max(std::abs(x - c.x), std::max(std::abs(y - c.y), std::abs(z - c.z))) != ring)
            continue;
          const std::size_t cell = index({x, y, z});
          for (std::uint32_t i = m_start[cell]; i < m_start[cell + 1]; ++i) {
            const Vec3f d = m_positions[i] - p;
            const float distance = glm::dot(d, d);
            if (distance < bestDistance || (distance == bestDistance && m_original[i] < best)) {
              bestDistance = distance;
              best = m_original[i];
            }
          }
        }
    // Clamping to the box of cells brings no particle nearer than it is, so whatever lies beyond
    // this ring is at least `ring` cells away.
    const float reach = static_cast<float>(ring) * m_edge;
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
      m_wantsUnscattered(wantsUnscattered(lights, layout)) {}

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
