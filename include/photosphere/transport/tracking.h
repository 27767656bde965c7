#pragma once
// Distances and transmittances through the medium, unbiased (delta and ratio tracking) and marched.
// Rays are given in local space as float: their origins lie at or inside the medium's bounds.

#include <cstdint>

#include "photosphere/core/fast_math.h"
#include "photosphere/core/rng.h"
#include "photosphere/transport/medium.h"

namespace photosphere::transport {

/// A part of a ray that lies inside the medium's bounds.
struct Segment {
  Vec3f origin{0.0f};     ///< point where the part begins, local space [m]
  Vec3f direction{0.0f};  ///< unit
  float length = 0.0f;    ///< [m]; 0 = nothing inside
  double begin = 0.0;     ///< distance from the ray's own origin to the part [m]
};

/// Clips a ray in double and rebases it at the bounds, so that far origins cost no precision.
Segment clipToMedium(const Medium& medium, const Vec3d& origin, const Vec3f& direction,
                     double maxDistance);

/// Distance from a point inside the medium's bounds to where a ray leaves them [m].
inline float exitDistance(const Medium& medium, const Vec3f& p, const Vec3f& d) {
  const Vec3f low(medium.bounds().min), high(medium.bounds().max);
  float t = kInfinity;
  for (int a = 0; a < 3; ++a)
    if (d[a] != 0.0f) t = glm::min(t, ((d[a] > 0.0f ? high[a] : low[a]) - p[a]) / d[a]);
  return glm::max(t, 0.0f);
}

/// How often the extinction exceeded its majorant. Counted, reported, never clamped away in
/// silence.
struct TrackingCounters {
  std::uint64_t majorantViolations = 0;
  std::uint64_t lookups = 0;
};

/// A real collision along a ray.
struct Collision {
  float distance = kInfinity;  ///< [m]; infinite when the ray leaves the medium first
  float extinction = 0.0f;     ///< sigma_t there [1/m]
  bool happened() const { return distance < kInfinity; }
};

/// The first real collision (Woodcock delta tracking over local majorants).
inline Collision sampleCollision(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                                 Rng& rng, TrackingCounters& counters) {
  volume::MajorantGrid::Walk walk(medium.majorants(), o, d, 0.0f, length);
  float tau = -fastLog(rng.uniformPositive());
  while (!walk.done()) {
    const float majorant = walk.majorant();
    const float end = walk.end();
    float t = walk.begin();
    while (true) {
      const float available = (end - t) * majorant;
      if (!(tau < available)) {
        tau -= available;
        break;
      }
      t += tau / majorant;
      const float sigma = medium.extinction(o + d * t);
      ++counters.lookups;
      if (sigma > majorant * 1.001f) ++counters.majorantViolations;
      if (rng.uniform() * majorant < sigma) return {t, sigma};
      tau = -fastLog(rng.uniformPositive());
    }
    walk.advance();
  }
  return {};
}

/// The first real collision and, from the same tentative ones, the ratio-tracked transmittance of
/// the whole ray: both unbiased, and correlated with each other.
inline Collision sampleCollisionAndTransmittance(const Medium& medium, const Vec3f& o,
                                                 const Vec3f& d, float length, Rng& rng,
                                                 TrackingCounters& counters, float& transmittance) {
  volume::MajorantGrid::Walk walk(medium.majorants(), o, d, 0.0f, length);
  Collision first;
  transmittance = 1.0f;
  float tau = -fastLog(rng.uniformPositive());
  for (; !walk.done(); walk.advance()) {
    const float majorant = walk.majorant();
    const float end = walk.end();
    float t = walk.begin();
    while (true) {
      const float available = (end - t) * majorant;
      if (!(tau < available)) {
        tau -= available;
        break;
      }
      t += tau / majorant;
      const float sigma = medium.extinction(o + d * t);
      ++counters.lookups;
      if (sigma > majorant * 1.001f) ++counters.majorantViolations;
      if (!first.happened() && rng.uniform() * majorant < sigma) first = {t, sigma};
      transmittance *= glm::max(0.0f, 1.0f - sigma / majorant);
      if (transmittance < 0.1f) {
        if (!(rng.uniform() * 0.1f < transmittance)) {
          transmittance = 0.0f;
          if (first.happened()) return first;
        } else {
          transmittance = 0.1f;
        }
      }
      tau = -fastLog(rng.uniformPositive());
    }
  }
  return first;
}

/// Unbiased transmittance along a ray (ratio tracking, Novak et al. 2014), with roulette once it is
/// small.
inline float trackTransmittance(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                                Rng& rng, TrackingCounters& counters) {
  volume::MajorantGrid::Walk walk(medium.majorants(), o, d, 0.0f, length);
  float transmittance = 1.0f;
  float tau = -fastLog(rng.uniformPositive());
  while (!walk.done()) {
    const float majorant = walk.majorant();
    const float end = walk.end();
    float t = walk.begin();
    while (true) {
      const float available = (end - t) * majorant;
      if (!(tau < available)) {
        tau -= available;
        break;
      }
      t += tau / majorant;
      const float sigma = medium.extinction(o + d * t);
      ++counters.lookups;
      if (sigma > majorant * 1.001f) ++counters.majorantViolations;
      transmittance *= glm::max(0.0f, 1.0f - sigma / majorant);
      if (transmittance < 0.1f) {
        // Survival in proportion to what is left keeps the estimate unbiased and ends dark rays.
        if (!(rng.uniform() * 0.1f < transmittance)) return 0.0f;
        transmittance = 0.1f;
      }
      tau = -fastLog(rng.uniformPositive());
    }
    walk.advance();
  }
  return transmittance;
}

/// Optical depth along a ray by the midpoint rule.
/// @param step  [m]
float marchOpticalDepth(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                        float step);

}  // namespace photosphere::transport
