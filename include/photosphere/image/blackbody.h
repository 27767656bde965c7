#pragma once
// Thermal radiation as colour: Planck's law seen by the CIE 1931 2 degree standard observer.

#include <cstdint>
#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/image/exr_attributes.h"

namespace photosphere::image {

/// Radiance of a black body as X, Y, Z [W m^-2 sr^-1]: the integral of Planck's law times each
/// colour matching function from 380 to 780 nm, over the integral of ybar, times that band's
/// width. A spectrum that is even over the band has its own radiance in the band as Y.
/// @param kelvin  [K]; zero and less give zero
/// Source: CIE 015:2018, table of the 1931 observer every 5 nm, summed by the trapezoid rule.
Vec3d blackbodyXyz(double kelvin);

/// RGB from X, Y, Z by primaries and white point, without adaptation: the white point is (1, 1, 1)
/// times its Y.
Mat3d rgbFromXyz(const Chromaticities& space);

/// Radiance of black bodies in a rendering space, for many temperatures of one range.
class BlackbodyTable {
 public:
  /// @param lowest, highest  [K], above zero
  BlackbodyTable(const Chromaticities& space, double lowest, double highest);
  /// RGB [W m^-2 sr^-1], not clipped: a channel is negative where the colour lies outside the
  /// space. Within 1e-4 of the exact value where the range is 300 to 8000 K; clamped to the range
  /// outside it; zero for zero kelvin and less.
  Vec3d at(double kelvin) const;

 private:
  double m_logLowest, m_inverseStep;
  std::vector<Vec3d> m_values;
};

}  // namespace photosphere::image
