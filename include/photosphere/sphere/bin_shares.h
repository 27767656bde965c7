#pragma once
// Which bins of a partition take the light of a direction (Min & Ihm 2010, section 4.1.2).

#include <cstdint>
#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/sphere/partition.h"
#include "photosphere/sphere/smoothing.h"

namespace photosphere::sphere {

enum class DirectionDeposit {
  nearest,      ///< the bin that holds the direction
  barycentric,  ///< the three bins whose centres surround it (four where four centres lie in one
                ///< plane about a mirror plane of the partition, so that mirroring stays exact)
  kernel,       ///< every bin within reach of a smoothing kernel
};

/// A bin and its part of the light.
struct BinShare {
  int bin = 0;
  float weight = 0;
};

/// Shares are not negative and sum to 1 in every direction. `barycentric` is continuous, and at the
/// centre of a bin that bin has all. Same bits on every CPU; immutable, thread-safe.
class BinShares {
 public:
  /// @param kernel  used by DirectionDeposit::kernel alone. @throws ConfigError for that with
  /// `none`
  explicit BinShares(const Partition& partition,
                     DirectionDeposit deposit = DirectionDeposit::nearest,
                     const SmoothingKernel& kernel = {});

  const Partition& partition() const { return m_partition; }
  DirectionDeposit deposit() const { return m_deposit; }
  /// Most shares that a direction has.
  int maxShares() const;
  /// Writes the shares of a unit direction that are not zero. The zero vector counts as +z.
  /// @param out  room for maxShares()
  /// @return number of shares
  int shares(const Vec3f& w, BinShare* out) const;

 private:
  // A corner of a face seen from octant 0: cell within its octant, and the axes to flip.
  struct Corner {
    int cell = 0;
    int flip = 0;
  };
  struct Triangle {
    Vec3f row[3];  // times a direction: its coordinates along the corners, up to scale
    int corner[3];
  };
  // Three corners and one triangle, or four corners and both ways to cut them, two triangles each.
  struct Face {
    std::vector<Corner> corners;
    std::vector<Triangle> triangles;
  };

  void mesh();
  void addFace(const std::vector<Corner>& corners);
  void addStrip(int row);
  void findCandidates();
  std::size_t faceOf(const Vec3f& mirrored) const;
  std::size_t bestFace(const Vec3f& mirrored) const;
  Vec3d position(const Corner& corner) const;
  int barycentric(const Vec3f& w, BinShare* out) const;
  int spread(const Vec3f& w, BinShare* out) const;

  Partition m_partition;
  DirectionDeposit m_deposit;
  SmoothingKernel m_kernel;
  std::vector<Vec3f> m_centers;
  std::vector<Face> m_faces;                             // those that octant 0 meets
  std::vector<std::vector<std::uint32_t>> m_candidates;  // by cell of octant 0
};

}  // namespace photosphere::sphere
