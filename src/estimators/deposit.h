#pragma once
// Sinks that add flights to fixed-point sums on light voxels or particles.

#include <atomic>
#include <memory>

#include "cell_grid.h"
#include "photosphere/estimators/light_field.h"
#include "photosphere/sphere/partition.h"

namespace photosphere::estimators {

/// Which lamps' light is kept before its first event: those with extent, where that is asked for.
std::vector<bool> wantsUnscattered(const transport::LightList& lights, bool unscattered);

/// The set a flight belongs to: 0 = light scattered before, 1 = light as its lamp sent it. -1 =
/// none: the lamp's own light is evaluated at march time.
int setOf(const transport::Flight& flight, const std::vector<bool>& wantsUnscattered);

/// Integer sums of one light field and the worth of one unit.
struct FixedSums {
  std::vector<std::int64_t> sums;
  double quantum = 1.0;
  std::atomic<std::uint64_t> overflows{0};

  /// Adds value (of the quantum's unit); `bits` rounds it.
  void add(std::size_t at, double value, std::uint32_t bits);
};

/// 32 bits from a deposit's own coordinates: photon, flight and number within the flight.
std::uint32_t roundingBits(RandomKey key, std::uint64_t photon, std::uint32_t flight,
                           std::uint32_t deposit);

/// Deposits on the active voxels of a lattice: power times length (track length), or power over
/// extinction at collisions.
class VoxelSink final : public transport::FlightSink {
 public:
  VoxelSink(const transport::Medium& medium, const transport::LightList& lights,
            const LightFieldLayout& layout, const View& view,
            const transport::SupportLattice& lattice, RandomKey key, FixedSums& sums);
  void consume(std::span<const transport::Flight> flights) override;

 private:
  void depositTrack(const transport::Flight& flight, std::size_t set) const;
  void depositCollision(const transport::Flight& flight, std::size_t set) const;
  void add(const transport::Flight& flight, std::size_t base, const Rgb& powerLength,
           const Vec3f& at, int bin, std::uint32_t& counter) const;

  const transport::Medium& m_medium;
  LightFieldLayout m_layout;
  View m_view;
  const transport::SupportLattice& m_lattice;
  RandomKey m_key;
  FixedSums& m_sums;
  sphere::Partition m_partition;
  std::vector<bool> m_wantsUnscattered;  // by lamp
};

/// Particles in cubic cells, for range queries. Positions are copied in cell order.
class ParticleIndex {
 public:
  ParticleIndex(const std::vector<Vec3f>& positions, double cellEdge);
  /// Calls visit(particle, squared distance) for every particle within `radius` of p.
  template <class Visit>
  void forEachWithin(const Vec3f& p, float radius, const Visit& visit) const {
    m_grid.forEachRun(p, radius, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) {
        const Vec3f d = m_positions[i] - p;
        const float distance = glm::dot(d, d);
        if (distance <= radius * radius)
          visit(static_cast<std::size_t>(m_grid.order()[i]), distance);
      }
    });
  }
  /// The particle nearest to p; ties go to the lowest number.
  std::size_t nearest(const Vec3f& p) const;

 private:
  CellGrid m_grid;
  std::vector<Vec3f> m_positions;
};

/// Deposits collisions on particles by eq. 7a or 7b.
class ParticleSink final : public transport::FlightSink {
 public:
  ParticleSink(const transport::Medium& medium, const transport::LightList& lights,
               const LightFieldLayout& layout, const View& view,
               const std::vector<Vec3f>& positions, const ParticleIndex& index, RandomKey key,
               FixedSums& sums);
  void consume(std::span<const transport::Flight> flights) override;
  std::uint64_t farPhotons() const { return m_far; }

 private:
  void deposit(const transport::Flight& flight, std::size_t set,
               std::vector<std::pair<std::size_t, float>>& scratch);

  const transport::Medium& m_medium;
  LightFieldLayout m_layout;
  View m_view;
  const std::vector<Vec3f>& m_positions;
  const ParticleIndex& m_index;
  RandomKey m_key;
  FixedSums& m_sums;
  sphere::Partition m_partition;
  std::vector<bool> m_wantsUnscattered;
  std::atomic<std::uint64_t> m_far{0};
};

/// Weight of the spatial kernel at a squared distance over the squared radius; zero beyond 1.
inline float kernelWeight(SpatialKernel kernel, float relativeSquared) {
  if (!(relativeSquared <= 1.0f)) return 0.0f;
  switch (kernel) {
    case SpatialKernel::epanechnikov:
      return 1.0f - relativeSquared;
    case SpatialKernel::box:
      return 1.0f;
    case SpatialKernel::gaussian:
      return fastExp(-4.5f * relativeSquared);  // cut at 3 sigma = radius
  }
  return 0.0f;
}

}  // namespace photosphere::estimators
