#pragma once
// Light that smoke gives off by itself, whether or not it scatters: flames and hot gas.

#include <cstdint>
#include <vector>

#include "photosphere/core/hash.h"
#include "photosphere/core/types.h"
#include "photosphere/volume/bricks.h"
#include "photosphere/volume/majorant_grid.h"

namespace photosphere::transport {

/// Emission of one volume, trilinear between its nodes.
struct VolumeEmission {
  /// At each node j [W m^-3 sr^-1] as RGB and, as w, the largest of the three; all >= 0. Empty =
  /// the volume does not emit.
  volume::BrickField<Vec4f> field;
  Mat4d localFromNode{1.0};  ///< node position of `field` to local space [m]
};

/// A node value of VolumeEmission::field.
inline Vec4f emissionNode(const Rgb& j) {
  return {j, maxComponent(j)};
}

/// Sum of the emission of volumes, for lookups and for the birth of photons. Holds pointers to
/// them. Immutable; reading is thread-safe. Local space [m].
class Emission {
 public:
  /// @param volumes  those with a field alone; they must outlive this
  /// @param reach    farthest that any of them moves while the shutter is open [m]
  explicit Emission(const std::vector<const VolumeEmission*>& volumes, double reach = 0.0);

  /// j [W m^-3 sr^-1]; zero where nothing emits.
  Rgb at(const Vec3f& p) const {
    Vec4f sum(0.0f);
    for (const Placed& v : m_placed)
      sum += v.field->sample(v.nodeFromLocal(p));
    return Rgb(sum);
  }
  /// Of one of the volumes, counted from 0.
  Rgb part(std::size_t volume, const Vec3f& p) const {
    const Placed& v = m_placed[volume];
    return Rgb(v.field->sample(v.nodeFromLocal(p)));
  }
  /// What emits, for the lattice that rays walk.
  const volume::WalkedRegion& region() const { return m_region; }
  /// Notes which cells of that lattice can emit.
  void markCells(const volume::MajorantGrid& lattice);
  bool inCell(std::size_t cell) const { return m_cells[cell] != 0; }

  /// 4 pi times the integral of j [W].
  const Vec3d& power() const { return m_power; }
  /// The scalar that births are shared by [W]: 4 pi times the integral of the largest channel. No
  /// photon of `birth` carries more in any channel.
  double birthPower() const { return m_birthPower; }
  /// True when j is grey everywhere.
  bool isGrey() const { return m_grey; }

  struct Birth {
    Vec3f origin{0.0f};
    Rgb power{0.0f};         ///< [W], for a photon that stands for all of `birthPower`
    std::size_t volume = 0;  ///< that it leaves, counted from 0
  };
  /// A point drawn in proportion to the largest channel of j, exactly as it is interpolated.
  /// @param u       chooses the node, in storage order: evenly spread values spread over space
  /// @param offset  place within the node's reach
  Birth birth(double u, const Vec3f& offset) const;

  void hash(Hasher& hasher) const;
  std::uint64_t memoryBytes() const;

 private:
  struct Placed {
    const volume::BrickField<Vec4f>* field;
    volume::NodeFromLocal nodeFromLocal;
    Mat4d localFromNode;
  };
  // A stored brick, and the integral of the largest channel up to and with it [W].
  struct Source {
    std::uint32_t volume;
    std::int32_t brick;
    Vec3i lowest;
    double cumulative;
  };

  std::vector<Placed> m_placed;
  std::vector<Source> m_sources;
  std::vector<std::uint8_t> m_cells;
  volume::WalkedRegion m_region;
  double m_reach = 0.0;
  Vec3d m_power{0.0};
  double m_birthPower = 0.0;
  bool m_grey = true;
};

}  // namespace photosphere::transport
