#pragma once
// Radiance that leaves plane-parallel slabs, against the reference values of
// data/reference/slab.csv.

#include <array>
#include <string>
#include <vector>

#include "stability_catalogue.h"

namespace photosphere::study {

/// One slab under a beam, and what is known of the light that leaves it.
struct SlabRadiance {
  struct Direction {
    bool top = true;   ///< leaves the lit face; else the far one
    double mu = 1;     ///< |cosine| to the normal
    double value = 0;  ///< scattered radiance per unit irradiance [1/sr]
  };
  double tau = 0, albedo = 0, g = 0;
  std::vector<Direction> directions;

  /// A slab of extinction 1 in z = -tau/2 .. tau/2, faded out over one voxel: radiance depends on
  /// the optical depth alone.
  SmokeSpec smoke() const;
  /// Settings over the base scene: medium, lamp, a camera of parallel rays.
  /// @param effort  0 = the case's photons; 1 and 2 = more, for directions in which few leave
  std::vector<std::string> settings(const Direction& direction, std::size_t effort) const;
  /// Radiance per unit irradiance below which effort 1 and 2 are called for [1/sr].
  static constexpr std::array kDim{4e-2, 1e-3};
};

/// Slabs of `g` with tau <= 8 and their directions of mu >= 0.3. @param quick  tau 2, three mu
/// @throws InputMissingError when reference/slab.csv is not among the shipped data
std::vector<SlabRadiance> slabRadiances(double g, bool quick);

}  // namespace photosphere::study
