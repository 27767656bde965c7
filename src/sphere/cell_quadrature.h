#pragma once
// Integrals over the cells of one octant, refined only where a lobe needs it.

#include <span>
#include <vector>

#include "photosphere/sphere/bin_weights.h"

namespace photosphere::sphere {

/// A tree of ever smaller pieces of each first-octant cell, with Gauss points in each piece. An
/// integral takes the largest pieces on which the integrand is smooth: those small against their
/// distance from the lobe's axis, or against the lobe's width.
class CellQuadrature {
 public:
  /// @param width  of the lobe [rad]: the scale on which it varies at its peak
  CellQuadrature(const Partition& partition, double width);

  /// Mean of phase(w, wo) over first-octant cell `cell` [1/sr].
  /// @param peak  unit direction about which phase(., wo) peaks
  double mean(int cell, const BinWeights::Phase& phase, const Vec3f& wo, const Vec3f& peak) const;

 private:
  static constexpr int kOrder = 3;
  static constexpr int kPoints = kOrder * kOrder;

  struct Piece {
    Vec3f center{0.0f};
    float radius = 0;    // chord from the centre to the farthest corner
    int firstChild = 0;  // two children, or 0 for a leaf
  };
  struct Point {
    Vec3f direction;
    float weight;  // part of the cell's area
  };
  struct Range {
    double sMin, sMax, azimuthMin, azimuthMax;
  };

  bool smooth(const Piece& piece, const Vec3f& peak) const;
  void fill(std::size_t index, const Range& range, double cellArea);
  double integrate(std::size_t index, const BinWeights::Phase& phase, const Vec3f& wo,
                   const Vec3f& peak) const;

  double m_width;
  std::vector<Piece> m_pieces;  // the roots first, one a cell
  std::vector<Point> m_points;  // kPoints a piece
};

}  // namespace photosphere::sphere
