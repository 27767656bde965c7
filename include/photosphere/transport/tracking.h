#pragma once
// Distances and transmittances through the medium, unbiased (delta and ratio tracking) and marched.
// Rays are given in local space as float: their origins lie at or inside the medium's bounds. Each
// takes the time last: `Still`, or a `Moment` of a medium that moves.

#include <cstdint>
#include <type_traits>

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

/// Distance from a point inside a box to where a ray leaves it.
inline float exitDistance(const Vec3f& low, const Vec3f& high, const Vec3f& p, const Vec3f& d) {
  float t = kInfinity;
  for (int a = 0; a < 3; ++a)
    if (d[a] != 0.0f) t = glm::min(t, ((d[a] > 0.0f ? high[a] : low[a]) - p[a]) / d[a]);
  return glm::max(t, 0.0f);
}
/// Distance from a point inside the medium's bounds to where a ray leaves them [m].
inline float exitDistance(const Medium& medium, const Vec3f& p, const Vec3f& d) {
  return exitDistance(Vec3f(medium.bounds().min), Vec3f(medium.bounds().max), p, d);
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

/// Parts of a distance along a ray below which floats do not tell two places apart.
inline constexpr float kDistanceResolution = 0x1p-21f;

/// A length in which optical depth grows by at most `depth`, from where extinction is sigma and
/// rises by no more than `slope` [1/m^2].
inline float thinPart(float sigma, float slope, float depth) {
  // (sigma + slope * part) * part = depth, solved without cancellation.
  return 2.0f * depth / (sigma + std::sqrt(sigma * sigma + 4.0f * slope * depth));
}

/// Extinction from where a part begins on. Smoke may begin at a face, of which rounding tells
/// either side: what lies a little farther counts too.
/// @param spacing  of nodes along any direction, at least [m]
template <class Along>
inline float extinctionOnward(const Along& extinction, float t, float spacing) {
  constexpr float kLittle = 0x1p-10f;
  return glm::max(extinction(t),
                  extinction(t + glm::max(kLittle * spacing, kDistanceResolution * t)));
}

/// A cell so thick that a walk past the edge of its smoke would draw many collisions that are none
/// is walked in parts, each with a majorant of its own: extinction where the part begins, plus what
/// it can rise by on the way (Medium::steepness). Their number grows with the root of the depth.
/// @param t          where the walk is, inside the cell
/// @param steepness  Medium::steepness [1/m]
/// @param tau        optical depth to the next tentative collision, carried on from part to part
/// @return false when `visit` did
template <class Along, class Visit>
inline bool walkThickCell(const Along& extinction, float t, float end, float majorant,
                          float steepness, float& tau, Rng& rng, TrackingCounters& counters,
                          const Visit& visit) {
  constexpr float kPartDepth = 2.0f;    // of a part that begins in thin smoke
  constexpr float kWholeDepth = 16.0f;  // of one near the cell's own majorant
  const float slope = majorant * steepness, spacing = 1.0f / steepness;
  while (t < end) {
    const float sigma = extinctionOnward(extinction, t, spacing);
    counters.lookups += 2;
    float part = kWholeDepth / majorant, bound = majorant;
    if (sigma < 0.25f * majorant) {
      part = glm::max(thinPart(sigma, slope, kPartDepth), kDistanceResolution * t);
      // Faces are steeper than that: one that lies within the part shows at its end.
      bound = glm::max(sigma + slope * part, extinctionOnward(extinction, t + part, spacing));
      bound = glm::min(majorant, bound * 1.0001f);
      counters.lookups += 2;
    }
    const float stop = glm::min(end, t + glm::max(part, kDistanceResolution * t));
    while (true) {
      const float available = (stop - t) * bound;
      if (!(tau < available)) {
        tau -= available;
        break;
      }
      t += tau / bound;
      const float here = extinction(t);
      ++counters.lookups;
      if (here > bound * 1.001f) ++counters.majorantViolations;
      if (!visit(t, here, bound)) return false;
      tau = -fastLog(rng.uniformPositive());
    }
    t = stop;
  }
  return true;
}

/// Depth of a voxel from where on its cell is walked in parts.
inline constexpr float kThickVoxel = 16.0f;

/// Calls visit(distance, sigma_t, majorant) for the tentative collisions of a ray, drawn against
/// the local majorants in order, until it returns false: the walk that delta and ratio tracking
/// share.
/// @param density  1, or more to draw that many times as many: majorants are so much larger
template <class Visit, class When = Still>
inline void forEachTentative(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                             Rng& rng, TrackingCounters& counters, const Visit& visit,
                             When when = {}, float density = 1.0f) {
  const auto extinction = medium.alongRay(o, d, when);
  const float thick = kThickVoxel * medium.steepness();
  float tau = -fastLog(rng.uniformPositive());
  for (volume::MajorantGrid::Walk walk(medium.majorants(), o, d, 0.0f, length); !walk.done();
       walk.advance()) {
    const float majorant = walk.majorant() * density;
    const float end = walk.end();
    float t = walk.begin();
    if constexpr (std::is_same_v<When, Still>)
      if (majorant > thick) {
        if (!walkThickCell(extinction, t, end, majorant, medium.steepness(), tau, rng, counters,
                           visit))
          return;
        continue;
      }
    while (true) {
      const float available = (end - t) * majorant;
      if (!(tau < available)) {
        tau -= available;
        break;
      }
      t += tau / majorant;
      const float sigma = extinction(t);
      ++counters.lookups;
      if (sigma > majorant * 1.001f) ++counters.majorantViolations;
      if (!visit(t, sigma, majorant)) return;
      tau = -fastLog(rng.uniformPositive());
    }
  }
}

/// What is left of light along a ray: of all channels alike, or of each.
inline float largestOf(float transmittance) {
  return transmittance;
}
inline float largestOf(const Rgb& transmittance) {
  return maxComponent(transmittance);
}

/// sigma_t as a transmittance takes it: one number, or one for each channel.
/// @tparam Light  float or Rgb
/// @param sigma   Medium::extinction at p
template <class Light, class When>
inline Light extinctionAs(const Medium& medium, const Vec3f& p, float sigma, When when) {
  if constexpr (std::is_same_v<Light, float>)
    return sigma;
  else
    return medium.channels(p, sigma, when);
}

/// Roulette over light of which less than a tenth is left: its factor, which is 0 where the ray
/// ends dark and whose mean is 1. Survival is in proportion to what is left.
inline constexpr float kRouletteFrom = 0.1f;
inline float roulette(float left, Rng& rng) {
  if (!(left < kRouletteFrom)) return 1.0f;
  return left > 1e-30f && rng.uniform() * kRouletteFrom < left ? kRouletteFrom / left : 0.0f;
}

/// The factor of one tentative collision in a ratio-tracked transmittance, with roulette once that
/// is small.
/// @tparam Light  float, or Rgb where the channels differ
/// @return false when the ray has ended dark
template <class Light>
inline bool attenuate(Light& transmittance, const Light& sigma, float majorant, Rng& rng) {
  transmittance *= glm::max(Light(0.0f), Light(1.0f) - sigma / majorant);
  const float factor = roulette(largestOf(transmittance), rng);
  transmittance *= factor;
  return factor > 0.0f;
}

/// The first real collision (Woodcock delta tracking over local majorants). Where channels differ,
/// it is one of the densest: `scatter` then decides what it is for the light that arrives.
template <class When = Still>
inline Collision sampleCollision(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                                 Rng& rng, TrackingCounters& counters, When when = {}) {
  Collision hit;
  forEachTentative(
      medium, o, d, length, rng, counters,
      [&](float t, float sigma, float majorant) {
        const bool real = rng.uniform() * majorant < sigma;
        if (real) hit = {t, sigma};
        return !real;
      },
      when);
  return hit;
}

/// Unbiased transmittance along a ray (ratio tracking, Novak et al. 2014).
/// @tparam Light  float, or Rgb where the channels differ
template <class Light = float, class When = Still>
inline Light trackTransmittance(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                                Rng& rng, TrackingCounters& counters, When when = {}) {
  Light transmittance(1.0f);
  forEachTentative(
      medium, o, d, length, rng, counters,
      [&](float t, float sigma, float majorant) {
        const Light own = extinctionAs<Light>(medium, o + d * t, sigma, when);
        return attenuate(transmittance, own, majorant, rng);
      },
      when);
  return transmittance;
}

/// The first real collision and, from the same tentative ones, the transmittance of the whole ray:
/// both unbiased, and correlated with each other.
template <class Light, class When = Still>
inline Collision sampleCollisionAndTransmittance(const Medium& medium, const Vec3f& o,
                                                 const Vec3f& d, float length, Rng& rng,
                                                 TrackingCounters& counters, Light& transmittance,
                                                 When when = {}) {
  Collision first;
  transmittance = Light(1.0f);
  forEachTentative(
      medium, o, d, length, rng, counters,
      [&](float t, float sigma, float majorant) {
        if (!first.happened() && rng.uniform() * majorant < sigma) first = {t, sigma};
        const Light own = extinctionAs<Light>(medium, o + d * t, sigma, when);
        // A ray that has ended dark walks on only until it has its collision.
        return attenuate(transmittance, own, majorant, rng) || !first.happened();
      },
      when);
  return first;
}

/// The integral of the majorants along a ray: no optical depth exceeds it.
inline float majorantDepth(const Medium& medium, const Vec3f& o, const Vec3f& d, float length) {
  float depth = 0.0f;
  for (volume::MajorantGrid::Walk walk(medium.majorants(), o, d, 0.0f, length); !walk.done();
       walk.advance())
    depth += (walk.end() - walk.begin()) * walk.majorant();
  return depth;
}

/// A collision that stands for all that a ray has, rather than for one that may not come.
/// @tparam Light  float, or Rgb where the channels differ
template <class Light>
struct ForcedCollision {
  Collision hit;
  float weight = 0.0f;  ///< of the hit; its mean is 1 - transmittance (of the densest channel)
  Light transmittance{1.0f};  ///< of the whole ray, unbiased
};

/// Draws one of the tentative collisions of the whole ray, each with the chance that the first real
/// one is there: weight times f(hit) has the mean of f at the first real collision, 0 where there
/// is none. Where channels do not differ, weight and transmittance add up to 1. In thin smoke, of
/// which most rays would meet nothing, more tentative collisions are drawn than the majorants ask
/// for.
template <class Light, class When = Still>
inline ForcedCollision<Light> forceCollision(const Medium& medium, const Vec3f& o, const Vec3f& d,
                                             float length, Rng& rng, TrackingCounters& counters,
                                             When when = {}) {
  constexpr float kTentative = 8.0f;  // on the mean, at least
  ForcedCollision<Light> forced;
  const float depth = majorantDepth(medium, o, d, length);
  if (!(depth > 0.0f)) return forced;
  float left = 1.0f;  // of the densest channel
  bool dark = false;
  forEachTentative(
      medium, o, d, length, rng, counters,
      [&](float t, float sigma, float majorant) {
        // Of what is left a part collides; of little all or nothing, so that the sum stays 1.
        float first = left * glm::min(1.0f, sigma / majorant);
        if (left < kRouletteFrom) first = rng.uniform() * majorant < sigma ? left : 0.0f;
        forced.weight += first;
        if (rng.uniform() * forced.weight < first) forced.hit = {t, sigma};
        left -= first;
        if constexpr (std::is_same_v<Light, float>) {
          forced.transmittance = left;
          return left > 0.0f;
        } else {
          if (!dark)
            dark = !attenuate(forced.transmittance, medium.channels(o + d * t, sigma, when),
                              majorant, rng);
          return left > 0.0f || !dark;
        }
      },
      when, glm::clamp(kTentative / depth, 1.0f, 1e30f));
  return forced;
}

/// Unbiased integral of the medium's emission along a ray [W m^-2 sr^-1], not attenuated: up to a
/// real collision its mean is what arrives attenuated. One random point in every stretch of the
/// lattice that can emit.
template <class When = Still>
inline Rgb sampleEmission(const Medium& medium, const Emission& emission, const Vec3f& o,
                          const Vec3f& d, float length, Rng& rng, When when = {}) {
  Rgb sum(0.0f);
  for (volume::MajorantGrid::Walk walk(medium.majorants(), o, d, 0.0f, length); !walk.done();
       walk.advance()) {
    if (!emission.inCell(walk.cell())) continue;
    const float span = walk.end() - walk.begin();
    if (span > 0.0f)
      sum += span * medium.emitted(o + d * (walk.begin() + rng.uniform() * span), when);
  }
  return sum;
}

/// Optical depth along a ray by the midpoint rule.
/// @tparam Light  float, or Rgb where the channels differ
/// @param step    [m]
template <class Light = float, class When = Still>
Light marchOpticalDepth(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                        float step, When when = {});

}  // namespace photosphere::transport
