#pragma once
// The participating medium of a frame: any number of overlapping volumes whose coefficients add.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
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

/// The smoke as it stands at the frame's own time: what a medium that holds still is asked for.
struct Still {};

/// Medium::livingShare is no smaller: what collisions that are as much rarer are weighted by fits.
inline constexpr float kSmallestShare = 0x1p-24f;

/// A time while the shutter is open.
struct Moment {
  float seconds = 0.0f;  ///< relative to the frame [s]
};

/// When the shutter opens and closes, relative to the frame [s].
struct Shutter {
  double open = 0.0, close = 0.0;
  double longest() const { return std::max(std::abs(open), std::abs(close)); }
};

/// How a volume moves while the shutter is open: what lies at x0 at the frame's time lies at
/// x0 + t v(x0) at time t, with its density, albedo and emission.
struct VolumeMotion {
  volume::BrickField<Vec4f> velocity;  ///< x, y, z [m/s] in local space; empty = the volume rests
  Mat4d localFromNode{1.0};            ///< node position of `velocity` to local space [m]
  double fastest = 0.0;                ///< [m/s]

  /// Farthest that anything moves while the shutter is open [m].
  double reach(const Shutter& shutter) const {
    return velocity.empty() ? 0.0 : fastest * shutter.longest();
  }
};

/// One volume, placed in local space (lights/light.h, LocalSpace).
struct MediumVolume {
  std::string name;
  volume::BrickField<float> density;
  Mat4d localFromNode{1.0};   ///< node position of `density` to local space [m]
  double densityScale = 1.0;  ///< extinction per unit of density of the densest channel [1/m]
  Rgb tint{1.0f};             ///< extinction of each channel over that of the densest, in [0, 1]
  Rgb albedo{0.9f};           ///< used where no albedo grid is given
  std::vector<volume::BrickField<float>> albedoFields;  ///< none, one (grey) or three
  Mat4d localFromAlbedoNode{1.0};
  phase::PhaseFunction phase;
  VolumeEmission emission;  ///< its field is empty where the volume does not emit
  VolumeMotion motion;
};

/// Coefficients at a point.
struct Coefficients {
  /// sigma_t [1/m]; where it differs from channel to channel, the sum over volumes of the densest
  /// channel's: no channel's is larger, and collisions are drawn at this rate
  float extinction = 0.0f;
  std::array<Rgb, kMaxPhases> scattering{};  ///< sigma_s of each distinct phase function [1/m]
  Rgb totalScattering(int phases) const {
    Rgb sum(0.0f);
    for (int i = 0; i < phases; ++i)
      sum += scattering[static_cast<std::size_t>(i)];
    return sum;
  }
};

/// Immutable; reading is thread-safe. All positions in local space [m], directions unit. Lookups
/// take the time as their last argument: `Still` compiles to no trace of motion, and a medium that
/// does not move gives the same at every `Moment`.
class Medium {
 public:
  /// @throws ConfigError when the volumes have more than kMaxPhases distinct phase functions
  explicit Medium(std::vector<MediumVolume> volumes, const Shutter& shutter = {});

  /// sigma_t [1/m] as Coefficients::extinction. Only for a medium with bounds: an empty one has no
  /// place to ask about.
  float extinction(const Vec3f& p, Still = {}) const {
    const Placed& first = m_placed.front();
    return first.scale * first.field->sample(first.nodeFromLocal(p)) + others(p);
  }
  float extinction(const Vec3f& p, Moment when) const;
  /// The same, and `carrierOf` of the place in `carrier`, for little more than one of the two.
  float extinction(const Vec3f& p, Moment when, Vec3f& carrier) const;
  /// sigma_t of each channel [1/m], where `extinction` gave `sum` at the same place and time.
  template <class When>
  Rgb channels(const Vec3f& p, float sum, When when) const {
    return m_tint ? sum * *m_tint : channelSum(p, when);
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
  /// The same while the smoke moves.
  struct AlongRayAt {
    float operator()(float t) const { return medium->extinction(origin + direction * t, when); }
    const Medium* medium;
    Vec3f origin, direction;
    Moment when;
  };
  AlongRay alongRay(const Vec3f& o, const Vec3f& d, Still = {}) const { return {*this, o, d}; }
  AlongRayAt alongRay(const Vec3f& o, const Vec3f& d, Moment when) const {
    return {this, o, d, when};
  }

  /// All coefficients at a point.
  void coefficients(const Vec3f& p, Coefficients& out, Still = {}) const;
  void coefficients(const Vec3f& p, Coefficients& out, Moment when) const;
  /// Emission at a point [W m^-3 sr^-1]. Only for a medium with `emission()`.
  Rgb emitted(const Vec3f& p, Still = {}) const { return m_emission->at(p); }
  Rgb emitted(const Vec3f& p, Moment when) const;

  /// True when something moves while the shutter is open.
  bool isMoving() const { return m_moving; }
  const Shutter& shutter() const { return m_shutter; }
  /// Farthest that anything moves from where the frame's caches have it [m].
  double displacement() const { return m_displacement; }
  /// True when extinction differs from channel to channel.
  bool isColoured() const { return m_coloured; }
  /// Extinction of each channel over `extinction`, where that is the same everywhere.
  const Rgb* tint() const { return m_tint ? &*m_tint : nullptr; }
  /// What the channels that still carry light need of `extinction`, in (0, 1]: none of them is
  /// extinguished faster than that part of it, anywhere.
  /// @param power  of each channel, in any unit
  float livingShare(const Rgb& power) const {
    float share = kSmallestShare;
    for (int channel = 0; channel < 3; ++channel)
      if (power[channel] > 0.0f) share = std::max(share, m_densest[channel]);
    return share;
  }

  /// Where the smoke that is at `p` then lies at the frame's own time; of several volumes, the mean
  /// by their extinction. Light is stored there, so that it rides with the smoke.
  Vec3f carrierOf(const Vec3f& p, Still) const { return p; }
  Vec3f carrierOf(const Vec3f& p, Moment when) const;

  /// Where what one of the emitting volumes has at `p` at the frame's own time lies then.
  /// @param emitter  Emission::Birth::volume
  Vec3f moved(std::size_t, const Vec3f& p, Still) const { return p; }
  Vec3f moved(std::size_t emitter, const Vec3f& p, Moment when) const {
    const Motion& motion = m_motions[m_emitting[emitter]];
    if (!motion.velocity) return p;
    return p + when.seconds * Vec3f(motion.velocity->sample(motion.nodeFromLocal(p)));
  }

  /// The albedo, where one number (or colour) holds everywhere and extinction is grey; nullptr
  /// where it varies.
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
  /// How steep extinction can be along any direction, as a part of the largest node around [1/m]:
  /// interpolated values change by no more than that from one voxel to the next. At the frame's own
  /// time.
  float steepness() const { return m_steepness; }
  /// True when every albedo and extinction has equal channels.
  bool isGrey() const { return m_grey; }
  /// Largest albedo of any channel where there is smoke.
  float maximumAlbedo() const { return m_maximumAlbedo; }
  const std::vector<MediumVolume>& volumes() const { return m_volumes; }
  /// What it was made of, to make another of.
  std::vector<MediumVolume> takeVolumes() && { return std::move(m_volumes); }
  /// The same smoke at rest. Leaves this medium empty.
  Medium held() &&;
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
  struct Motion {
    const volume::BrickField<Vec4f>* velocity;  // nullptr = the volume rests
    volume::NodeFromLocal nodeFromLocal;
  };

  template <class When>
  void gather(const Vec3f& p, Coefficients& out, When when) const;
  template <class When>
  Rgb channelSum(const Vec3f& p, When when) const;
  // Where what is at `p` then lies at the frame's own time: two steps of x0 = p - t v(x0).
  Vec3f rest(std::size_t, const Vec3f& p, Still) const { return p; }
  Vec3f rest(std::size_t volume, const Vec3f& p, Moment when) const {
    const Motion& motion = m_motions[volume];
    if (!motion.velocity) return p;
    const Vec3f v(motion.velocity->sample(motion.nodeFromLocal(p)));
    const Vec3f before = p - when.seconds * v;
    return p - when.seconds * Vec3f(motion.velocity->sample(motion.nodeFromLocal(before)));
  }
  void hashVolume(Hasher& hasher, const MediumVolume& volume) const;
  void findColours();

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
  std::vector<Motion> m_motions;
  std::vector<std::size_t> m_emitting;  // volumes of m_emission, in its order
  std::vector<phase::PhaseFunction> m_phases;
  std::unique_ptr<Emission> m_emission;
  std::optional<Rgb> m_tint;
  Rgb m_densest{1.0f};  // largest tint of each channel
  Shutter m_shutter;
  double m_displacement = 0.0;
  bool m_moving = false, m_coloured = false;
  volume::MajorantGrid m_majorants;
  double m_voxelEdge = 1.0;
  float m_steepness = 0.0f;
  bool m_grey = true;
  bool m_uniformAlbedo = false;
  float m_maximumAlbedo = 0.0f;
  std::string m_hash;
};

/// Part of a ray inside a box. @return false when it misses
bool clip(const Box3d& box, const Vec3d& origin, const Vec3d& direction, double& t0, double& t1);

}  // namespace photosphere::transport
