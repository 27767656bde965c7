#pragma once
// The light field: what photons leave on carriers, before any view is known. This is what a light
// cache holds.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/estimators/inscatter.h"
#include "photosphere/lights/light.h"
#include "photosphere/sphere/bin_shares.h"
#include "photosphere/transport/photon_tracer.h"
#include "photosphere/transport/support_lattice.h"

namespace photosphere::estimators {

enum class Carrier { voxels, particles };
enum class Basis { histogram, sphericalHarmonics, view };
enum class Deposit { trackLength, collision };
/// How a collision reaches particles (METHOD.md section 4): gather is eq. 7a, scatter eq. 7b.
enum class EnergyRule { gather, scatter };
enum class SpatialKernel { epanechnikov, box, gaussian };
/// How fluence on voxels is smoothed by the spatial kernel (METHOD.md section 5.3).
enum class Smoothing {
  twicing,  ///< plainly, then sharpened by what a second blur takes away
  plain,    ///< weighted means of fluence, which lose light where the smoke is lit at its edge
  density,  ///< of fluence times extinction, over those of extinction, which gain light there
  mean,     ///< the mean of `plain` and `density`
  visible,  ///< of fluence times what is seen of the smoke where a photon passes, over those of the
            ///< latter, by the eye (Basis::view) or from all round: right where a light voxel is
            ///< many mean free paths deep
};
/// What stands for the directions of a bin (Min & Ihm 2010, figure 5).
enum class Representative {
  bin,   ///< the bin itself: light is spread over it
  mean,  ///< the mean direction of what fell in the bin, kept beside it
};
/// Bins of a particle that a gather reads (section 4.2.2, figure 9).
enum class Merge {
  full,
  sampled,  ///< one, drawn in proportion to its power and weighted so that the mean is that of
            ///< `full`
};
/// When the direction toward the eye is taken.
enum class Evaluate {
  perView,  ///< once for each carrier, but at every step next to an eye in smoke (nearEye)
  perStep,  ///< at every march step, as in the paper
};

/// Everything that decides what a carrier's numbers mean, and how they are read.
struct LightFieldLayout {
  Carrier carrier = Carrier::voxels;
  Basis basis = Basis::view;
  Deposit deposit = Deposit::trackLength;
  EnergyRule energy = EnergyRule::gather;
  SpatialKernel kernel = SpatialKernel::epanechnikov;
  Smoothing smoothing = Smoothing::twicing;  ///< of fluence on voxels, resolved per view
  int rows = 2;                              ///< 8 rows^2 direction bins (histogram)
  int order = 4;                             ///< (order + 1)^2 coefficients (sphericalHarmonics)
  int channels = 3;                          ///< 1 where lights and media are grey
  int phases = 1;                            ///< distinct phase functions (view)
  bool unscattered =
      false;  ///< a second set holds the light of lamps with extent before its first event
  double lightVoxel = 2.0;     ///< light voxel edge over density voxel edge
  double radius = 0.0;         ///< support of the spatial kernel [m]
  double depositRadius = 0.0;  ///< [m]; particles with collision deposit
  // Histogram alone:
  sphere::DirectionDeposit direction = sphere::DirectionDeposit::nearest;
  Representative representative = Representative::bin;
  Merge merge = Merge::full;  ///< particles
  Evaluate evaluate = Evaluate::perView;
  /// Distance from the eye up to which perView, too, reads directions at every march step [light
  /// voxels]: a carrier next to the eye is seen from many. 0 = nowhere.
  double nearEye = 0.0;
  /// Smooths directions when they are read, or spreads them when they are deposited
  /// (DirectionDeposit::kernel): once, not twice.
  sphere::AngularKernel angularKernel = sphere::AngularKernel::none;
  double bandwidth = 0.5;   ///< of angularKernel [rad]
  double truncation = 3.0;  ///< of angularKernel [bandwidths]
  int directions = 128;     ///< K of eq. 9, 8 n^2; Merge::sampled

  /// Values of one set and channel: bins, coefficients, or one for each phase function.
  int bins() const {
    if (basis == Basis::view) return phases;
    return basis == Basis::histogram ? 8 * rows * rows : (order + 1) * (order + 1);
  }
  /// Floats of one set (scattered, unscattered) of one carrier: [bin][channel], then for
  /// Representative::mean [bin][3], the sum of power times direction.
  int setSize() const { return bins() * (channels + (keepsMeans() ? 3 : 0)); }
  int valuesPerCarrier() const { return setSize() * (unscattered ? 2 : 1); }
  bool keepsMeans() const {
    return basis == Basis::histogram && representative == Representative::mean;
  }
  /// @throws ConfigError for a bandwidth or truncation that makes no kernel
  sphere::SmoothingKernel directionKernel() const { return {angularKernel, bandwidth, truncation}; }
  /// How directions reach bins. @throws ConfigError for DirectionDeposit::kernel without a kernel
  sphere::BinShares binShares() const {
    return sphere::BinShares(sphere::Partition(rows), direction, directionKernel());
  }
  /// True when values are power [W] of collisions rather than fluence rate.
  bool holdsPower() const { return carrier == Carrier::particles && deposit == Deposit::collision; }
};

/// Values on carriers, [carrier][set][bin][channel]. Histogram: fluence rate that arrives in the
/// bin [W m^-2], or power [W] (holdsPower). Spherical harmonics: the same light times Y_lm of the
/// direction it travels in. View: times the phase function toward the eye [1/sr].
struct LightField {
  LightFieldLayout layout;
  transport::SupportLattice lattice;  ///< light voxels; the carriers themselves for Carrier::voxels
  std::vector<Vec3f> particles;       ///< positions, local space [m]; Carrier::particles
  std::vector<float> values;
  /// What the values of voxels count by for Smoothing::visible, visibleWeights; nothing = `resolve`
  /// makes them.
  std::shared_ptr<const std::vector<float>> weights;
  /// Directions of the same light around an eye in smoke, for Basis::view, which keeps none; null
  /// where nobody asks (LightFieldLayout::nearEye).
  std::shared_ptr<LightField> near;
  std::uint64_t photons = 0;     ///< emitted in all
  std::uint64_t farPhotons = 0;  ///< collisions without a particle in range, given to the nearest

  std::size_t carriers() const {
    return layout.carrier == Carrier::voxels ? lattice.size() : particles.size();
  }
  std::uint64_t memoryBytes() const {
    return lattice.memoryBytes() + particles.size() * sizeof(Vec3f) +
           values.size() * sizeof(float) + (near ? near->memoryBytes() : 0);
  }
};

/// @throws ConfigError naming the keys of the first combination that has no meaning (METHOD.md
/// section 4, legal combinations)
void checkLayout(const LightFieldLayout& layout);

/// Traces photons and gathers them on carriers.
/// @param view       used by Basis::view alone
/// @param particles  positions, local space; used by Carrier::particles alone
/// @throws ConfigError for combinations that METHOD.md section 4 does not allow (checkLayout) or
/// without particles;
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

/// Whether light near the eye is read apart from the rest: where the layout says so
/// (LightFieldLayout::nearEye), and there is smoke.
bool readsNearEye(const transport::Medium& medium, const LightFieldLayout& layout,
                  const View& view);
/// What is kept around the eye: the same, and bins of directions where there are none
/// (Basis::view), at least as many as `rows` makes.
LightFieldLayout nearLayout(const LightFieldLayout& layout);
/// Memory that directions around an eye in smoke take at most while they are gathered and read, for
/// Basis::view, which keeps none elsewhere [B]; 0 where none are kept (power on particles).
std::uint64_t nearEyeBytes(const transport::Medium& medium, const LightFieldLayout& layout,
                           const View& view);

/// Mean over each voxel of the lattice of extinction times transmittance toward the eye, or in the
/// mean of all directions (any basis but Basis::view), times the voxel's edge [1]: what photons
/// count by for Smoothing::visible. They depend on the smoke and the view alone, so that fields of
/// other photons share them.
std::shared_ptr<const std::vector<float>> visibleWeights(const transport::Medium& medium,
                                                         const transport::SupportLattice& lattice,
                                                         const LightFieldLayout& layout,
                                                         const View& view);

/// Resolves the field for one view: histogram and phase fold into one colour per carrier and phase
/// function, which is then smoothed and laid out for lookups (METHOD.md sections 5.1 to 5.3).
/// Evaluate::perStep keeps the field instead and asks it at every march step, as is done next to an
/// eye in smoke (LightFieldLayout::nearEye).
/// @param medium  must outlive the source
/// @param field   std::move it where it is not needed again
/// @param key     of the random numbers that Merge::sampled draws
std::unique_ptr<InscatterSource> resolve(const transport::Medium& medium, LightField field,
                                         const View& view, RandomKey key = {});

}  // namespace photosphere::estimators
