#pragma once
// What particles around a point say of the light there.

#include <vector>

#include "particle_index.h"
#include "photosphere/transport/medium.h"
#include "voxel_smoothing.h"

namespace photosphere::estimators {

/// Weights of the particles in range of a point, by the layout's rule. Thread-safe.
class ParticleGather {
 public:
  /// @param field  must outlive the gather
  ParticleGather(const LightField& field, const transport::Medium& medium);

  struct Part {
    std::size_t particle;
    float weight;
  };
  /// Fluence: half the mean of the particles' own and half the evened-out mean, which err with
  /// opposite sign at the smoke's edge (METHOD.md section 5.3); weights sum to 1.
  /// Power: weights turn it into collision density [1/m^3]: eq. 7a with the ball's volume 4/3 pi
  /// R^3 (the paper prints 3/4, errata 1), or eq. 7b.
  /// @return false when no particle is in range
  bool around(const Vec3f& p, std::vector<Part>& parts) const;
  /// The particle nearest to p.
  std::size_t nearest(const Vec3f& p) const { return m_index.nearest(p); }

  /// Sums of weighted colours at the voxels of a lattice; voxels in no particle's range take the
  /// mean of their neighbours (fluence) or nothing (power).
  Colours atVoxels(const transport::SupportLattice& lattice, const Colours& colours) const;

 private:
  const LightField& m_field;
  ParticleIndex m_index;
  float m_radius;
  float m_ballVolume;
  std::vector<float> m_extinction;  // particles crowd where smoke is dense; dividing evens them out
};

}  // namespace photosphere::estimators
