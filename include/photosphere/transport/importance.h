#pragma once
// Which light a picture can see: photons are born and followed by how much they may add to it
// (consistent adjoint driven importance sampling, Wagner and Haghighat 1998), without bias.

#include <cstdint>
#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/lights/light.h"

namespace photosphere::transport {

class Medium;

/// Coarse lattice of cubes over the smoke: in each, how much the picture gains on the mean from a
/// photon that leaves a collision there (adjoint fluence; any unit). Local space [m].
class ImportanceMap {
 public:
  /// @param cells  along the longest side of the box
  ImportanceMap(const Box3d& bounds, int cells);

  std::size_t size() const { return m_values.size(); }
  float at(const Vec3f& p) const { return m_values[index(p)]; }
  std::size_t index(const Vec3f& p) const {
    const Vec3i c = glm::clamp(Vec3i((p - m_origin) * m_inverseEdge), Vec3i(0), m_dims - 1);
    return (static_cast<std::size_t>(c.z) * static_cast<std::size_t>(m_dims.y) +
            static_cast<std::size_t>(c.y)) *
               static_cast<std::size_t>(m_dims.x) +
           static_cast<std::size_t>(c.x);
  }
  float edge() const { return 1.0f / m_inverseEdge; }
  /// Takes sums over the cells and smooths them over neighbours, as few paths leave them noisy.
  void set(const std::vector<double>& sums);

 private:
  Vec3f m_origin{0.0f};
  float m_inverseEdge = 1.0f;
  Vec3i m_dims{1};
  std::vector<float> m_values;
};

using LightList = std::vector<std::unique_ptr<lights::Light>>;

/// What births and flights of photons are steered by. Immutable; thread-safe.
class PhotonGuide {
 public:
  PhotonGuide(const Medium& medium, const LightList& lights, ImportanceMap importance);

  /// False where no light was found that the picture could gain from: nothing to steer by.
  bool useful() const { return m_mean > 0.0; }

  /// Probability of each source: the lamps, then the medium's own emission.
  const std::vector<double>& sources() const { return m_sources; }

  struct Drawn {
    Vec2d u{0.0};
    float weight = 1.0f;  ///< uniform density over that of the drawing
  };
  /// The two numbers that choose a photon's direction or place at its source, drawn where the
  /// picture gains most. Evenly spread numbers stay evenly spread.
  Drawn draw(std::size_t source, const Vec2d& u) const;

  /// Weight that a photon at `p` should have, where 1 is what all have that are not steered.
  float wantedWeight(const Vec3f& p) const {
    const float value = m_importance.at(p);
    return glm::clamp(static_cast<float>(m_mean) / glm::max(value, 1e-30f), kLeast, kMost);
  }

  static constexpr float kLeast = 1.0f / 16.0f, kMost = 64.0f;
  static constexpr int kCells = 32;  ///< of each of the two numbers

 private:
  struct Table {
    std::vector<float> rows;     // cumulative over rows, kCells + 1
    std::vector<float> columns;  // of each row, kCells + 1
    std::vector<float> density;  // over uniform
  };

  // @param usual  the source's power as Light::power tells it [W]
  double gain(const Medium& medium, const LightList& lights, const lights::BoundingSphere& bounds,
              std::size_t source, double usual, const Vec4f& u) const;
  static Table tableOf(const std::vector<double>& gains, double mean);

  ImportanceMap m_importance;
  std::vector<double> m_sources;
  std::vector<Table> m_tables;
  double m_mean = 0.0;  // of a photon that is not steered
};

}  // namespace photosphere::transport
