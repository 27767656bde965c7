#pragma once
// Radiance along a camera ray: the march, which asks an estimator, and path tracing, the truth.

#include <cstdint>
#include <memory>
#include <vector>

#include "photosphere/core/effects.h"
#include "photosphere/core/rng.h"
#include "photosphere/estimators/inscatter.h"
#include "photosphere/render/shadows.h"
#include "photosphere/transport/medium.h"
#include "photosphere/transport/photon_tracer.h"
#include "photosphere/transport/tracking.h"

namespace photosphere::render {

/// Radiance of one camera ray, layer by layer [W m^-2 sr^-1].
struct RayRadiance {
  Rgb single{0.0f};    ///< light of lamps scattered once
  Rgb multiple{0.0f};  ///< light scattered twice or more
  Rgb emission{0.0f};
  Rgb background{0.0f};  ///< surroundings seen through the smoke
  Rgb transmittance{1.0f};
  float depth = 0.0f;    ///< sum of opacity times distance [m]; divide by the opacity
  float opacity = 0.0f;  ///< what `depth` was weighted with

  Rgb total() const { return single + multiple + emission + background; }
};

/// Counts that a frame reports. Merged over threads.
struct IntegratorCounters {
  transport::TrackingCounters tracking;
  std::uint64_t scatterings = 0;  ///< real collisions of path tracing
  std::uint64_t capped = 0;       ///< paths ended by max_scatter
  double cappedRadiance = 0.0;    ///< throughput they still carried, summed

  void add(const IntegratorCounters& other) {
    tracking.majorantViolations += other.tracking.majorantViolations;
    tracking.lookups += other.tracking.lookups;
    scatterings += other.scatterings;
    capped += other.capped;
    cappedRadiance += other.cappedRadiance;
  }
};

class Integrator {
 public:
  virtual ~Integrator() = default;
  /// @param origin     local space [m], double
  /// @param direction  unit
  /// @param when       acts where the smoke moves
  virtual RayRadiance radiance(const Vec3d& origin, const Vec3f& direction, transport::Moment when,
                               Rng& rng, IntegratorCounters& counters) const = 0;
};

/// How path tracing meets the light of uniform surroundings.
enum class EnvironmentSampling {
  escape,     ///< by rays that leave the smoke: exact
  nextEvent,  ///< by sampling a direction at every collision
};

struct PathOptions {
  int maxScatter = 0;  ///< 0 = none
  EnvironmentSampling environment = EnvironmentSampling::escape;
  Effects effects;
};

/// Unbiased path tracing: delta tracking, next-event estimation with ratio-tracked shadows, first
/// flights that collide for certain, points drawn along flights for lamps that are near; no
/// bounce cap unless asked.
std::unique_ptr<Integrator> makePathIntegrator(const transport::Medium& medium,
                                               const transport::LightList& lights,
                                               const PathOptions& options);

struct MarchOptions {
  float step = 1.0f;   ///< march step over voxel edge
  int gatherRays = 0;  ///< of each camera ray; > 0 = final gathering: `multiple` is looked up after
                       ///< the first bounce, from a source that answers toward any direction
  Effects effects;
};

/// Marching with analytic step integration. `source` may be null: single scattering alone.
std::unique_ptr<Integrator> makeMarchIntegrator(const transport::Medium& medium,
                                                const transport::LightList& lights,
                                                const Shadows& shadows,
                                                const estimators::InscatterSource* source,
                                                const MarchOptions& options);

}  // namespace photosphere::render
