#pragma once
// The integer sums that a light field is made of: what shards of a trace add up, and what a trace
// that is interrupted goes on from (METHOD.md section 6).

#include <cstdint>
#include <memory>
#include <vector>

#include "photosphere/core/checkpoint.h"
#include "photosphere/estimators/light_field.h"

namespace photosphere::estimators {

/// What photons have left so far. Sums of several add up to those of all their photons, in any
/// order, to the same bits.
struct LightSums {
  LightFieldLayout layout;
  /// Where light is gathered: the carriers themselves, but for track lengths whose carriers are
  /// particles.
  transport::SupportLattice lattice;
  std::vector<Vec3f> particles;  ///< positions, local space [m]; Carrier::particles
  /// visibleWeights of the lattice, for Smoothing::visible, which `sums` are times of: nothing is
  /// left where they are 0.
  std::shared_ptr<const std::vector<float>> weights;
  std::vector<std::int64_t> sums;                  ///< [voxel or particle][set][bin][channel]
  std::shared_ptr<LightSums> near;                 ///< of LightField::near
  double quantum = 1.0;                            ///< worth of one unit [W m], or [W] (holdsPower)
  std::uint64_t photons = 0;                       ///< of the whole frame
  std::uint64_t firstPhoton = 0, photonCount = 0;  ///< of these, those that are summed here
  std::uint64_t farPhotons = 0;                    ///< see LightField

  /// Places that hold sums: voxels of the lattice, or particles.
  std::size_t places() const { return layout.holdsPower() ? particles.size() : lattice.size(); }
};

/// Traces the photons that the options name and sums what they leave.
/// @param weights     for Smoothing::visible: those of an earlier trace of the same smoke, lattice
///                    and view; nothing = they are made
/// @param checkpoint  goes on from its part `light` and keeps that while tracing; nullptr = no
/// @param part        tells parts of one checkpoint apart: only light of the same part is gone on
///                    from
/// @throws as traceLightField
LightSums traceLightSums(const transport::Medium& medium, const transport::LightList& lights,
                         const LightFieldLayout& layout, const View& view,
                         const std::vector<Vec3f>& particles,
                         const transport::TraceOptions& options,
                         transport::TraceStatistics& statistics,
                         std::shared_ptr<const std::vector<float>> weights = {},
                         Checkpoint* checkpoint = nullptr, std::uint64_t part = 0);

/// Adds the sums of other photons of the same frame. @throws Error when a sum leaves 63 bits
void addSums(LightSums& into, const LightSums& other);

/// The field that all photons' sums make: the one place where they become floats.
LightField toField(LightSums sums);

}  // namespace photosphere::estimators
