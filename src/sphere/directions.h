#pragma once
// Directions of the first octant from (s, azimuth), s = sqrt(1 - z). With only +, -, *, / and sqrt,
// so that deposits which depend on them have the same bits on every CPU.

#include <cmath>

#include "photosphere/core/exact_sine.h"
#include "photosphere/core/types.h"

namespace photosphere::sphere {

/// @param s        sqrt(1 - z) in [0, 1]; rows of the partition are even in it
/// @param azimuth  part of the octant's quarter turn, in [0, 1]
inline Vec3d octantDirection(double s, double azimuth) {
  const double sine = s * std::sqrt(2 - s * s);
  return {sine * exactSin((1 - azimuth) * kPi / 2), sine * exactSin(azimuth * kPi / 2), 1 - s * s};
}

/// A vector with the signs of an octant.
template <class V>
V mirroredInto(int octant, const V& w) {
  return {octant & 1 ? -w.x : w.x, octant & 2 ? -w.y : w.y, octant & 4 ? -w.z : w.z};
}

/// Row of a cell of octant 0: the rows before row i hold i^2 cells.
inline int rowOf(int cellInOctant) {
  int row = static_cast<int>(std::sqrt(static_cast<double>(cellInOctant)));
  while (row * row > cellInOctant)
    --row;
  while ((row + 1) * (row + 1) <= cellInOctant)
    ++row;
  return row;
}

}  // namespace photosphere::sphere
