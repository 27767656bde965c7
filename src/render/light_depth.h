#pragma once
// Optical depth to one lamp, tabulated along the lamp's own rays.

#include <cstdint>
#include <optional>
#include <vector>

#include "photosphere/transport/medium.h"
#include "photosphere/transport/photon_tracer.h"

namespace photosphere::render {

/// Sparse lattice of nodes on rays from a lamp: two coordinates choose the ray, the third counts
/// along the lamp's axis. Each ray is marched once, so the work grows with the smoke's voxels and
/// not with their number times the way to the lamp. No spacing exceeds the density voxel. Reading
/// is thread-safe.
class LightDepth {
 public:
  /// Chooses the lattice; `fill` computes it.
  /// @return nothing where the lamp is inside the smoke's box or so near that one perspective
  ///         cannot hold it
  static std::optional<LightDepth> plan(const transport::Medium& medium,
                                        const lights::Light& light);
  /// Nodes that `fill` computes.
  std::uint64_t nodes() const {
    return m_active.size() * static_cast<std::uint64_t>(Field::kBrickSize);
  }
  /// Memory that `fill` needs while it works.
  std::uint64_t predictedBytes() const;
  /// @param step     largest march step [m]
  /// @param channel  whose extinction is summed; -1 = Medium::extinction
  /// @param when     nothing = the frame's own time
  void fill(const transport::Medium& medium, float step, int channel = -1,
            const std::optional<transport::Moment>& when = std::nullopt);

  /// Optical depth between the lamp and a place in the smoke. Local space.
  float at(const Vec3f& p) const {
    const Vec3f q = p - m_center;
    const float depth = glm::dot(q, m_axis);
    const float scale = 1.0f / (1.0f + depth * m_inverseDistance);
    return m_field.sample({glm::dot(q, m_right) * scale * m_raysPerLength - m_first.x,
                           glm::dot(q, m_up) * scale * m_raysPerLength - m_first.y,
                           depth * m_nodesPerLength - m_first.z});
  }
  std::uint64_t memoryBytes() const { return m_field.memoryBytes(); }

 private:
  using Field = volume::BrickField<float>;

  Vec3d nodePosition(const Vec3d& p) const;
  void chooseLattice(const Box3d& box);
  void findBricks(const volume::MajorantGrid& majorants);
  template <class Along>
  void marchColumn(const Along& along, float step, std::size_t first, std::size_t end,
                   float* nodes) const;
  template <class Along>
  void fillFrom(const Along& along, float step);

  Vec3f m_center{0.0f};                           // of the smoke, local space [m]
  Vec3f m_right{0.0f}, m_up{0.0f}, m_axis{0.0f};  // unit; the axis points away from the lamp
  float m_inverseDistance = 0.0f;                 // lamp to centre [1/m]; 0 = parallel rays
  float m_raysPerLength = 1.0f;                   // in the plane through the centre [1/m]
  float m_nodesPerLength = 1.0f;                  // along the axis [1/m]
  // Rays of the smoke's box, in nodes of the plane: those beyond its sides stand for the side.
  Vec2f m_lowest{0.0f}, m_highest{0.0f};
  Vec3f m_first{0.0f};  // node coordinates of node (0,0,0)
  Vec3i m_bricks{0};
  std::vector<Vec3i> m_active;  // column by column, along the axis in each
  Field m_field;
};

}  // namespace photosphere::render
