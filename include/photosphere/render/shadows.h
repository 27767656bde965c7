#pragma once
// Transmittance from a point to a lamp, in the three ways that render.shadow offers.

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

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

/// Shadows of every lamp of a frame. Reading is thread-safe.
class Shadows {
 public:
  /// @param step         march step [m]
  /// @param budgetBytes  grids past it fall back to `march`, said in the log; 0 = no limit
  Shadows(const transport::Medium& medium, const transport::LightList& lights, ShadowMode mode,
          float step, std::uint64_t budgetBytes);
  ~Shadows();

  /// Transmittance from `p` to lamp `light` [0, 1].
  /// @param direction, distance  as lights::Illumination gives them
  float transmittance(std::size_t light, const Vec3f& p, const Vec3f& direction, float distance,
                      Rng& rng, transport::TrackingCounters& counters) const;
  std::uint64_t memoryBytes() const;

 private:
  // On nodes of an upright lattice: for a lamp inside the smoke or close to it.
  struct Table {
    volume::BrickField<float> opticalDepth;
    Vec3f origin{0.0f};
    float inversePitch = 1.0f;
  };

  const transport::Medium* m_medium;
  ShadowMode m_mode;
  float m_step;
  std::vector<std::unique_ptr<LightDepth>> m_depths;  // of lamps that stand off
  std::vector<std::optional<Table>> m_tables;         // of the others

  Table uprightTable(const lights::Light& light, const transport::SupportLattice& lattice) const;
};

}  // namespace photosphere::render
