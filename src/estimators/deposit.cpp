#include "deposit.h"

#include <algorithm>
#include <array>
#include <bit>

namespace photosphere::estimators {

using transport::Flight;

std::vector<bool> wantsUnscattered(const transport::LightList& lights, bool unscattered) {
  std::vector<bool> wants;
  for (const auto& light : lights)
    wants.push_back(unscattered && !light->isDelta());
  return wants;
}

CarrierSums::CarrierSums(const transport::Medium& medium, const transport::LightList& lights,
                         const LightFieldLayout& layout, const View& view, RandomKey key,
                         FixedSums& sums)
    : m_stride(static_cast<std::size_t>(layout.valuesPerCarrier())),
      m_setSize(static_cast<std::size_t>(layout.setSize())),
      m_means(static_cast<std::size_t>(layout.bins() * layout.channels)),
      m_channels(layout.channels),
      m_basis(directionalBasis(layout, medium, view)),
      m_key(key),
      m_sums(sums),
      m_wantsUnscattered(wantsUnscattered(lights, layout.unscattered)) {}

template <class B>
void CarrierSums::add(const B& basis, const typename B::Along& along, const Flight& flight,
                      std::size_t carrier, int set, const Rgb& amount, const Vec3f& p,
                      std::uint32_t& counter) const {
  const std::size_t base = carrier * m_stride + static_cast<std::size_t>(set) * m_setSize;
  const auto bits = [&] { return roundingBits(m_key, flight.photon, flight.ordinal, counter++); };
  if constexpr (B::kMost > 0) {
    static_assert(B::kSigned && !B::kKeepsMeans);
    std::array<std::int64_t, static_cast<std::size_t>(3 * B::kMost)> whole;
    std::size_t count = 0;
    m_sums.prefetchRow(base, m_setSize);
    basis.at(flight, along, p, [&](int, float weight) {
      for (int c = 0; c < m_channels; ++c)
        whole[count++] = m_sums.wholeSigned(
            static_cast<double>(amount[c]) * static_cast<double>(weight), bits());
    });
    m_sums.addRow(base, {whole.data(), count});
    return;
  }
  basis.at(flight, along, p, [&](int value, float weight) {
    for (int c = 0; c < m_channels; ++c) {
      const std::size_t at = base + static_cast<std::size_t>(value * m_channels + c);
      const double part = static_cast<double>(amount[c]) * static_cast<double>(weight);
      if constexpr (B::kSigned)
        m_sums.addSigned(at, part, bits());
      else
        m_sums.add(at, part, bits());
    }
    if constexpr (B::kKeepsMeans) {
      const float mean = (m_channels == 1 ? amount.x : meanComponent(amount)) * weight;
      for (int axis = 0; axis < 3; ++axis)
        m_sums.addSigned(base + m_means + static_cast<std::size_t>(3 * value + axis),
                         static_cast<double>(mean) * static_cast<double>(flight.direction[axis]),
                         bits());
    }
  });
}

void VoxelSink::consume(std::span<const Flight> flights) {
  std::visit(
      [&]<class B>(const B& basis) {
        typename B::Along along;
        for (const Flight& flight : flights) {
          const int set = m_carriers.setOf(flight);
          if (set < 0) continue;
          if (m_deposit == Deposit::collision && !flight.collided()) continue;
          basis.begin(flight, along);
          if (m_deposit == Deposit::trackLength)
            depositTrack(basis, along, flight, set);
          else
            depositCollision(basis, along, flight, set);
        }
      },
      m_carriers.basis());
}

template <class B>
void VoxelSink::depositTrack(const B& basis, const typename B::Along& along, const Flight& flight,
                             int set) const {
  m_lattice.walk(flight.origin, flight.direction, flight.length,
                 [&](std::size_t voxel, float entry, float length) {
                   if (m_means && !((*m_means)[voxel] > 0.0f)) return;
                   // Where a voxel is entered, not how many came before: bits of rounding do not
                   // depend on which of them are stored.
                   std::uint32_t counter = std::bit_cast<std::uint32_t>(entry);
                   Vec3f at = flight.origin + flight.direction * (entry + 0.5f * length);
                   Rgb amount = flight.power * length;
                   if (m_weight) {
                     // At a random place of the way: the weight may change along it.
                     const float part = m_carriers.uniform(flight, counter);
                     at = flight.origin + flight.direction * (entry + part * length);
                     amount *= m_weight->at(voxel, at, direction(flight, counter));
                     if (!(maxComponent(amount) > 0.0f)) return;
                   }
                   m_carriers.add(basis, along, flight, voxel, set, amount, at, counter);
                 });
}

template <class B>
void VoxelSink::depositCollision(const B& basis, const typename B::Along& along,
                                 const Flight& flight, int set) const {
  const Vec3f p = flight.origin + flight.direction * flight.length;
  const Vec3d cell = (Vec3d(p) - m_lattice.origin()) / m_lattice.edge();
  const std::int32_t voxel = m_lattice.number(Vec3i(glm::floor(cell)));
  if (voxel < 0) return;
  std::uint32_t counter = 0;
  Rgb amount = flight.collisionPower() / flight.extinctionAtEnd;
  if (m_means && !((*m_means)[static_cast<std::size_t>(voxel)] > 0.0f)) return;
  if (m_weight)
    amount *= m_weight->at(static_cast<std::size_t>(voxel), p, direction(flight, counter));
  m_carriers.add(basis, along, flight, static_cast<std::size_t>(voxel), set, amount, p, counter);
}

void ParticleSink::consume(std::span<const Flight> flights) {
  std::vector<Target> targets;
  std::visit(
      [&]<class B>(const B& basis) {
        typename B::Along along;
        for (const Flight& flight : flights) {
          const int set = m_carriers.setOf(flight);
          if (set < 0 || !flight.collided()) continue;
          basis.begin(flight, along);
          findTargets(flight.origin + flight.direction * flight.length, targets);
          std::uint32_t counter = 0;
          const Rgb power = flight.collisionPower();
          for (const Target& target : targets)
            m_carriers.add(basis, along, flight, target.first, set, power * target.second,
                           m_positions[target.first], counter);
        }
      },
      m_carriers.basis());
}

// Eq. 7a: every particle in range takes the whole power; eq. 7b: they share it by the kernel.
void ParticleSink::findTargets(const Vec3f& p, std::vector<Target>& targets) {
  const bool whole = m_energy == EnergyRule::gather;
  targets.clear();
  float sum = 0.0f;
  m_index.forEachWithin(p, m_radius, [&](std::size_t particle, float squared) {
    const float w = whole ? 1.0f : kernelWeight(m_kernel, squared / (m_radius * m_radius));
    targets.emplace_back(particle, w);
    sum += w;
  });
  if (targets.empty() || !(sum > 0.0f)) {
    m_far.fetch_add(1, std::memory_order_relaxed);
    targets.assign(1, {m_index.nearest(p), 1.0f});
    return;
  }
  if (whole) return;
  const float share = 1.0f / sum;
  for (Target& target : targets)
    target.second *= share;
}

}  // namespace photosphere::estimators
