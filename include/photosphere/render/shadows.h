#pragma once
// Transmittance from a point to a lamp, in the three ways that render.shadow offers.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "photosphere/cameras/camera.h"
#include "photosphere/core/rng.h"
#include "photosphere/transport/medium.h"
#include "photosphere/transport/photon_tracer.h"
#include "photosphere/transport/support_lattice.h"
#include "photosphere/transport/tracking.h"

namespace photosphere::render {

class LightDepth;

enum class ShadowMode {
  grid,   ///< optical depth tabulated at the pitch of density voxels, for each lamp
  march,  ///< marched for every step
  track,  ///< ratio tracking, unbiased and noisy
};

/// What asks for shadows.
struct ShadowUse {
  /// Some rays of the camera, spread over the frame, local space: smoke whose shadows a grid cannot
  /// hold counts where these end as it does in all the smoke.
  std::vector<cameras::CameraRay> seen = {};
  /// Rays of the frame, where a grid must take less work than they do without; 0 = it need not.
  std::uint64_t rays = 0;
};

/// Shadows of every lamp of a frame. Reading is thread-safe.
class Shadows {
 public:
  /// Grids of smoke that moves are made for several times of the shutter and read between them;
  /// those of volumes whose extinctions have different colours, for each channel.
  /// @param step         march step [m]
  /// @param budgetBytes  grids past it fall back to `march`, said in the log; 0 = no limit
  /// @param use          nothing = of any number of rays from anywhere
  Shadows(const transport::Medium& medium, const transport::LightList& lights, ShadowMode mode,
          float step, std::uint64_t budgetBytes, const ShadowUse& use = {});
  ~Shadows();

  /// Transmittance from `p` to lamp `light` [0, 1].
  /// @tparam Light  float, or Rgb where extinction differs from channel to channel
  /// @param direction, distance  as lights::Illumination gives them
  template <class Light = float, class When = transport::Still>
  Light transmittance(std::size_t light, const Vec3f& p, const Vec3f& direction, float distance,
                      Rng& rng, transport::TrackingCounters& counters, When when = {}) const;
  std::uint64_t memoryBytes() const;

 private:
  // On nodes of an upright lattice: for a lamp inside the smoke or close to it.
  struct Table {
    volume::BrickField<float> opticalDepth;
    Vec3f origin{0.0f};
    float inversePitch = 1.0f;
    float at(const Vec3f& p) const { return opticalDepth.sample((p - origin) * inversePitch); }
  };
  // Of one lamp: time by time, and channel by channel in each; one of the two is empty.
  struct Tabulated {
    std::vector<LightDepth> depths;
    std::vector<Table> tables;
  };

  // Extinction that a grid sums up: of all channels together, or of one; at one time.
  struct Layer {
    int channel = -1;  // -1 = Medium::extinction
    std::optional<transport::Moment> when;
  };
  std::vector<Layer> layers() const;
  float marchedDepth(const transport::Segment& toLight, const Layer& layer) const;
  Table uprightTable(const lights::Light& light, const transport::SupportLattice& lattice,
                     const Layer& layer) const;
  // Optical depth in one set of grids.
  template <class Light, class Grids, class When>
  Light depthIn(const Grids& grids, const Vec3f& p, When when) const;

  const transport::Medium* m_medium;
  ShadowMode m_mode;
  float m_step;
  std::size_t m_channels = 1;  // grids of one time
  std::size_t m_times = 1;
  std::vector<Tabulated> m_tabulated;  // by lamp
};

}  // namespace photosphere::render
