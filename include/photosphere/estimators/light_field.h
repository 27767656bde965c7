#pragma once
// The light field: what photons leave on carriers, before any view is known. This is what a light
// cache holds.

#include <cstdint>
#include <string>
#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/estimators/inscatter.h"
#include "photosphere/lights/light.h"
#include "photosphere/transport/photon_tracer.h"
#include "photosphere/transport/support_lattice.h"

namespace photosphere::estimators {

enum class Carrier { voxels, particles };
enum class Basis { histogram, view };
enum class Deposit { trackLength, collision };
/// How a collision reaches particles (METHOD.md section 4): gather is eq. 7a, scatter eq. 7b.
enum class EnergyRule { gather, scatter };
enum class SpatialKernel { epanechnikov, box, gaussian };

/// Everything that decides what a carrier's numbers mean.
struct LightFieldLayout {
  Carrier carrier = Carrier::voxels;
  Basis basis = Basis::view;
  Deposit deposit = Deposit::trackLength;
  EnergyRule energy = EnergyRule::gather;
  SpatialKernel kernel = SpatialKernel::epanechnikov;
  int rows = 2;      ///< 8 rows^2 direction bins (histogram)
  int channels = 3;  ///< 1 where lights and media are grey
  int phases = 1;    ///< distinct phase functions (view)
  bool unscattered =
      false;  ///< a second set holds the light of lamps with extent before its first event
  double lightVoxel = 2.0;     ///< light voxel edge over density voxel edge
  double radius = 0.0;         ///< support of the spatial kernel [m]
  double depositRadius = 0.0;  ///< [m]; particles with collision deposit

  int bins() const { return basis == Basis::histogram ? 8 * rows * rows : phases; }
  /// Floats of one set (scattered, unscattered) of one carrier.
  int setSize() const { return bins() * channels; }
  int valuesPerCarrier() const { return setSize() * (unscattered ? 2 : 1); }
  /// True when values are power [W] of collisions rather than fluence rate.
  bool holdsPower() const { return carrier == Carrier::particles && deposit == Deposit::collision; }
};

/// Values on carriers, [carrier][set][bin][channel]. Histogram: fluence rate that arrives in the
/// bin [W m^-2], or power [W] (holdsPower). View: the same times the phase function toward the eye
/// [1/sr].
struct LightField {
  LightFieldLayout layout;
  transport::SupportLattice lattice;  ///< light voxels; the carriers themselves for Carrier::voxels
  std::vector<Vec3f> particles;       ///< positions, local space [m]; Carrier::particles
  std::vector<float> values;
  std::uint64_t photons = 0;     ///< emitted in all
  std::uint64_t farPhotons = 0;  ///< collisions without a particle in range, given to the nearest

  std::size_t carriers() const {
    return layout.carrier == Carrier::voxels ? lattice.size() : particles.size();
  }
  std::uint64_t memoryBytes() const {
    return lattice.memoryBytes() + particles.size() * sizeof(Vec3f) + values.size() * sizeof(float);
  }
};

/// Traces photons and gathers them on carriers.
/// @param view       used by Basis::view alone
/// @param particles  positions, local space; used by Carrier::particles alone
/// @throws ConfigError for combinations that METHOD.md section 4 does not allow or without
/// particles;
///         MemoryError
LightField traceLightField(const transport::Medium& medium, const transport::LightList& lights,
                           const LightFieldLayout& layout, const View& view,
                           const std::vector<Vec3f>& particles,
                           const transport::TraceOptions& options,
                           transport::TraceStatistics& statistics);

/// The radius that `radius = 0` stands for [m]: wide enough that its ball holds a few thousand
/// photon crossings, between half a light voxel (no smoothing) and four.
double automaticRadius(const transport::Medium& medium, const LightFieldLayout& layout,
                       std::uint64_t photons);

/// Resolves the field for one view: histogram and phase fold into one colour per carrier and phase
/// function, which is then smoothed and laid out for lookups (METHOD.md sections 5.1 to 5.3).
/// Fluence on voxels is smoothed plainly and sharpened by twicing, which was nearer to path tracing
/// in every case tried than METHOD's mean of plain and density-weighted smoothing.
std::unique_ptr<InscatterSource> resolve(const transport::Medium& medium, const LightField& field,
                                         const View& view);

}  // namespace photosphere::estimators
