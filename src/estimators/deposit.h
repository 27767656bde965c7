#pragma once
// Sinks that add flights to fixed-point sums on light voxels or particles.

#include <atomic>
#include <memory>

#include "directional_basis.h"
#include "particle_index.h"
#include "photosphere/core/fixed_point.h"
#include "photosphere/estimators/light_field.h"
#include "visible_weight.h"

namespace photosphere::estimators {

/// Which lamps' light is kept before its first event: those with extent, where that is asked for.
std::vector<bool> wantsUnscattered(const transport::LightList& lights, bool unscattered);

/// The set a flight belongs to: 0 = light scattered before or emitted by the smoke, which no other
/// term carries to its next scattering; 1 = light as its lamp sent it. -1 = none: the lamp's own
/// light is evaluated at march time.
/// @param wantsUnscattered  by lamp
inline int setOf(const transport::Flight& flight, const std::vector<bool>& wantsUnscattered) {
  if (flight.scatterings > 0 || flight.light == transport::kEmittedBySmoke) return 0;
  return wantsUnscattered[flight.light] ? 1 : -1;
}

/// What every sink does with a flight at a carrier: basis, channels, rounding, sums.
class CarrierSums {
 public:
  CarrierSums(const transport::Medium& medium, const transport::LightList& lights,
              const LightFieldLayout& layout, const View& view, RandomKey key, FixedSums& sums);

  const DirectionalBasis& basis() const { return m_basis; }
  /// Uniform in [0, 1), of a flight's deposit.
  float uniform(const transport::Flight& flight, std::uint32_t deposit) const {
    return static_cast<float>(roundingBits(m_key, flight.photon, flight.ordinal, ~deposit) >> 8) *
           0x1p-24f;
  }
  int setOf(const transport::Flight& flight) const {
    return estimators::setOf(flight, m_wantsUnscattered);
  }
  /// Adds `amount` (of the quantum's unit, by channel) that arrives at `p` to one carrier.
  /// @param counter  number of the next deposit within the flight
  template <class B>
  void add(const B& basis, const typename B::Along& along, const transport::Flight& flight,
           std::size_t carrier, int set, const Rgb& amount, const Vec3f& p,
           std::uint32_t& counter) const;

 private:
  std::size_t m_stride, m_setSize, m_means;  // floats of a carrier, of a set; where means begin
  int m_channels;
  DirectionalBasis m_basis;
  RandomKey m_key;
  FixedSums& m_sums;
  std::vector<bool> m_wantsUnscattered;  // by lamp
};

/// Deposits on the active voxels of a lattice: power times length (track length), or power over
/// extinction at collisions.
class VoxelSink final : public transport::FlightSink {
 public:
  /// @param weight  of a place, which multiplies what is deposited there; nullptr = 1
  /// @param means   of these over the voxels: nothing is deposited where they are 0; with `weight`
  VoxelSink(CarrierSums carriers, Deposit deposit, const transport::SupportLattice& lattice,
            const VisibleWeight* weight = nullptr, const std::vector<float>* means = nullptr)
      : m_carriers(std::move(carriers)),
        m_deposit(deposit),
        m_lattice(lattice),
        m_weight(weight),
        m_means(means) {}
  void consume(std::span<const transport::Flight> flights) override;

 private:
  template <class B>
  void depositTrack(const B& basis, const typename B::Along& along, const transport::Flight& flight,
                    int set) const;
  template <class B>
  void depositCollision(const B& basis, const typename B::Along& along,
                        const transport::Flight& flight, int set) const;
  // In [0, 1)^2, for a weight that looks all round.
  Vec2f direction(const transport::Flight& flight, std::uint32_t deposit) const {
    if (!m_weight->looksAllRound()) return Vec2f(0.0f);
    return {m_carriers.uniform(flight, deposit ^ 0x55555555u),
            m_carriers.uniform(flight, deposit ^ 0xaaaaaaaau)};
  }

  CarrierSums m_carriers;
  Deposit m_deposit;
  const transport::SupportLattice& m_lattice;
  const VisibleWeight* m_weight;
  const std::vector<float>* m_means;
};

/// Deposits collisions on particles by eq. 7a or 7b.
class ParticleSink final : public transport::FlightSink {
 public:
  ParticleSink(CarrierSums carriers, const LightFieldLayout& layout,
               const std::vector<Vec3f>& positions, const ParticleIndex& index)
      : m_carriers(std::move(carriers)),
        m_energy(layout.energy),
        m_kernel(layout.kernel),
        m_radius(static_cast<float>(layout.depositRadius)),
        m_positions(positions),
        m_index(index) {}
  void consume(std::span<const transport::Flight> flights) override;
  std::uint64_t farPhotons() const { return m_far; }

 private:
  // A particle and its part of the photon's power.
  using Target = std::pair<std::size_t, float>;
  void findTargets(const Vec3f& p, std::vector<Target>& targets);

  CarrierSums m_carriers;
  EnergyRule m_energy;
  SpatialKernel m_kernel;
  float m_radius;
  const std::vector<Vec3f>& m_positions;
  const ParticleIndex& m_index;
  std::atomic<std::uint64_t> m_far{0};
};

}  // namespace photosphere::estimators
