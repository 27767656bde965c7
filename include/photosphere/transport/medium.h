#pragma once
// The participating medium of a frame: any number of overlapping volumes whose coefficients add.

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/phase/phase.h"
#include "photosphere/transport/emission.h"
#include "photosphere/volume/bricks.h"
#include "photosphere/volume/majorant_grid.h"

namespace photosphere::transport {

/// Distinct phase functions one medium may mix. Volumes with equal phase share one.
inline constexpr int kMaxPhases = 8;

/// One volume, placed in local space (lights/light.h, LocalSpace).
struct MediumVolume {
  std::string name;
  volume::BrickField<float> density;
  Mat4d localFromNode{1.0};   ///< node position of `density` to local space [m]
  double densityScale = 1.0;  ///< extinction per unit of density [1/m]
  Rgb albedo{0.9f};           ///< used where no albedo grid is given
  std::vector<volume::BrickField<float>> albedoFields;  ///< none, one (grey) or three
  Mat4d localFromAlbedoNode{1.0};
  phase::PhaseFunction phase;
  VolumeEmission emission;  ///< its field is empty where the volume does not emit
};

/// Coefficients at a point.
struct Coefficients {
  float extinction = 0.0f;                   ///< sigma_t [1/m]
  std::array<Rgb, kMaxPhases> scattering{};  ///< sigma_s of each distinct phase function [1/m]
  Rgb totalScattering(int phases) const {
    Rgb sum(0.0f);
    for (int i = 0; i < phases; ++i)
      sum += scattering[static_cast<std::size_t>(i)];
    return sum;
  }
};

/// Immutable; reading is thread-safe. All positions in local space [m], directions unit.
class Medium {
 public:
  /// @throws ConfigError when the volumes have more than kMaxPhases distinct phase functions
  explicit Medium(std::vector<MediumVolume> volumes);

  /// sigma_t [1/m]. Only for a medium with bounds: an empty one has no place to ask about.
  float extinction(const Vec3f& p) const {
    const Placed& first = m_placed.front();
    return first.scale * first.field->sample(first.nodeFromLocal(p)) + others(p);
  }
  /// The same along a ray, whose way through the first volume's nodes is worked out once.
  class AlongRay {
   public:
    AlongRay(const Medium& medium, const Vec3f& o, const Vec3f& d)
        : m_medium(&medium), m_origin(o), m_direction(d) {
      const Placed& first = medium.m_placed.front();
      m_nodeOrigin = first.nodeFromLocal(o);
      m_nodeDirection = first.nodeFromLocal.direction(d);
    }
    /// sigma_t [1/m] at a distance [m].
    float operator()(float t) const {
      const Placed& first = m_medium->m_placed.front();
      const float sum = first.scale * first.field->sample(m_nodeOrigin + m_nodeDirection * t);
      return m_medium->m_placed.size() == 1 ? sum
                                            : sum + m_medium->others(m_origin + m_direction * t);
    }

   private:
    const Medium* m_medium;
    Vec3f m_origin, m_direction, m_nodeOrigin, m_nodeDirection;
  };
  /// All coefficients at a point.
  void coefficients(const Vec3f& p, Coefficients& out) const;

  /// The albedo, where one number (or colour) holds everywhere; nullptr where it varies.
  const Rgb* uniformAlbedo() const {
    return m_uniformAlbedo ? &m_albedo.front().constant : nullptr;
  }
  /// Distinct phase functions, in order of first use.
  const std::vector<phase::PhaseFunction>& phases() const { return m_phases; }
  const volume::MajorantGrid& majorants() const { return m_majorants; }
  /// Light that the medium gives off; nullptr when it gives off none.
  const Emission* emission() const { return m_emission.get(); }
  /// Tight box around all extinction and emission; empty when there is neither.
  const Box3d& bounds() const { return m_majorants.bounds(); }
  /// Smallest voxel edge of all densities [m]; of all emission where there is no density.
  double voxelEdge() const { return m_voxelEdge; }
  /// True when every albedo has equal channels.
  bool isGrey() const { return m_grey; }
  /// Largest albedo of any channel where there is smoke.
  float maximumAlbedo() const { return m_maximumAlbedo; }
  const std::vector<MediumVolume>& volumes() const { return m_volumes; }
  /// What it was made of, to make another of.
  std::vector<MediumVolume> takeVolumes() && { return std::move(m_volumes); }
  /// Hash of everything that light transport depends on, as 16 hex digits.
  const std::string& hash() const { return m_hash; }
  std::uint64_t memoryBytes() const;

 private:
  // What the lookup loop reads, compact.
  struct Placed {
    const volume::BrickField<float>* field;
    volume::NodeFromLocal nodeFromLocal;
    float scale;
    int phaseIndex;
  };
  struct Albedo {
    Rgb constant{0.0f};
    std::vector<Placed> fields;
    Rgb at(const Vec3f& p) const;
  };

  // sigma_t of every volume but the first.
  float others(const Vec3f& p) const {
    float sum = 0.0f;
    for (std::size_t i = 1; i < m_placed.size(); ++i)
      sum += m_placed[i].scale * m_placed[i].field->sample(m_placed[i].nodeFromLocal(p));
    return sum;
  }
  static Placed place(const volume::BrickField<float>& field, const Mat4d& localFromNode,
                      double scale, int phaseIndex);

  std::vector<MediumVolume> m_volumes;
  std::vector<Placed> m_placed;
  std::vector<Albedo> m_albedo;
  std::vector<phase::PhaseFunction> m_phases;
  std::unique_ptr<Emission> m_emission;
  volume::MajorantGrid m_majorants;
  double m_voxelEdge = 1.0;
  bool m_grey = true;
  bool m_uniformAlbedo = false;
  float m_maximumAlbedo = 0.0f;
  std::string m_hash;
};

/// Part of a ray inside a box. @return false when it misses
bool clip(const Box3d& box, const Vec3d& origin, const Vec3d& direction, double& t0, double& t1);

}  // namespace photosphere::transport
