#pragma once
// Phase functions averaged over the cells of a partition: what turns a direction histogram into
// in-scattered light (METHOD.md section 5.1).

#include <functional>
#include <memory>

#include "photosphere/core/types.h"
#include "photosphere/sphere/bin_shares.h"
#include "photosphere/sphere/partition.h"

namespace photosphere::sphere {

/// How the light inside a bin is thought to be spread.
enum class Reconstruction {
  constant,  ///< as it was collected: evenly over the cell for `nearest`, so that the phase
             ///< function is averaged over the bin, by its share elsewhere
  smooth,    ///< as a smooth function over the sphere that would leave this histogram: removes
             ///< most of the error that wide bins make where phase and light peak together; weights
             ///< may be slightly negative. Above 512 bins light is taken as even over every cell,
             ///< which is as good there
};

/// W_j(wo) = integral of f(w, wo) b_j(w) dw [1/sr], the phase function averaged over the light of
/// bin j (b_j, of unit integral), for every outgoing direction wo. The partition looks the same
/// from every octant, so only first-octant wo are tabulated, on a triangular lattice whose spacing
/// follows the width of the lobe; between its nodes W_j is linear. Every node is scaled to
/// sum_j A W_j = 1 (quadrature leaves below 1e-4), which linear interpolation keeps. A node is
/// computed when it is first asked for, as a camera asks for few of a sharp lobe's thousands; it
/// depends on nothing else, so results do not either. Thread-safe; copies share what was computed.
class BinWeights {
 public:
  /// Phase function [1/sr] of unit propagation directions. It must depend on the angle between them
  /// alone, be safe to call from several threads and stay valid as long as the weights.
  using Phase = std::function<double(const Vec3f& w, const Vec3f& wo)>;

  /// @param meanCosine  g of the lobe: 1 - |g| sets the resolution of the quadrature and lattice,
  /// its
  ///                    sign the side of the peak. Finer than |g| = 0.995 is treated as that.
  BinWeights(const BinShares& deposit, const Phase& phase, double meanCosine,
             Reconstruction reconstruction = Reconstruction::constant);
  /// The same for `nearest` deposit.
  BinWeights(const Partition& partition, const Phase& phase, double meanCosine,
             Reconstruction reconstruction = Reconstruction::constant)
      : BinWeights(BinShares(partition), phase, meanCosine, reconstruction) {}

  int size() const { return m_partition.size(); }
  /// Writes size() weights [1/sr] for a unit propagation direction toward the eye. The zero vector
  /// counts as +z.
  void weights(const Vec3f& wo, float* out) const;
  /// Edges of the lattice along one side of the octant.
  int latticeSize() const;

 private:
  class Nodes;

  Partition m_partition;
  std::shared_ptr<Nodes> m_nodes;
};

}  // namespace photosphere::sphere
