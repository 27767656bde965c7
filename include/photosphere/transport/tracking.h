#pragma once
// Distances and transmittances through the medium, unbiased (delta and ratio tracking) and marched.
// Rays are given in local space as float: their origins lie at or inside the medium's bounds. Each
// takes the time last: `Still`, or a `Moment` of a medium that moves.

#include <cstdint>
#include <type_traits>

#include "photosphere/core/fast_math.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/rng.h"
#include "photosphere/transport/medium.h"
#include "photosphere/transport/roulette.h"

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

  void looked(unsigned times = 1) {
    lookups += times;
    // A few milliseconds of lookups: no ray is so long that a signal goes unheard.
    if ((lookups & 0xffff) < times) throwIfInterrupted();
  }
};

/// A real collision along a ray.
struct Collision {
  float distance = kInfinity;  ///< [m]; infinite when the ray leaves the medium first
  float extinction = 0.0f;     ///< sigma_t there [1/m], Coefficients::extinction
  float share = 1.0f;          ///< rate of such collisions over `extinction`
  bool happened() const { return distance < kInfinity; }
};

/// How many tentative collisions are drawn: as many as the majorants ask for.
struct Whole {
  static constexpr float share = 1.0f, density = 1.0f;
};
/// More of them: majorants are so many times larger.
struct Denser {
  static constexpr float share = 1.0f;
  float density = 1.0f;
};
/// As many as a part of the extinction asks for, which visitors may make smaller on the way: what
/// is densest no longer matters once its light is gone.
struct Living {
  float share = 1.0f;  ///< Medium::livingShare
  float density = 1.0f;
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
/// @param whole      majorant of the cell [1/m]
/// @param steepness  Medium::steepness [1/m]
/// @param tau        optical depth to the next tentative collision, carried on from part to part
/// @return false when `visit` did
template <class Along, class Visit, class Draw>
inline bool walkThickCell(const Along& extinction, float t, float end, float whole, float steepness,
                          float& tau, Rng& rng, TrackingCounters& counters, const Visit& visit,
                          const Draw& draw) {
  constexpr float kPartDepth = 2.0f;    // of a part that begins in thin smoke
  constexpr float kWholeDepth = 16.0f;  // of one near the cell's own majorant
  const float spacing = 1.0f / steepness;
  while (t < end) {
    const float share = draw.share, rate = share * draw.density;
    const float majorant = whole * rate, slope = majorant * steepness;
    const float sigma = extinctionOnward(extinction, t, spacing) * rate;
    counters.looked(2);
    float part = kWholeDepth / majorant, bound = majorant;
    if (sigma < 0.25f * majorant) {
      part = glm::max(thinPart(sigma, slope, kPartDepth), kDistanceResolution * t);
      // Faces are steeper than that: one that lies within the part shows at its end.
      bound =
          glm::max(sigma + slope * part, extinctionOnward(extinction, t + part, spacing) * rate);
      bound = glm::min(majorant, bound * 1.0001f);
      counters.looked(2);
    }
    float stop = glm::min(end, t + glm::max(part, kDistanceResolution * t));
    while (true) {
      const float available = (stop - t) * bound;
      if (!(tau < available)) {
        tau -= available;
        break;
      }
      t += tau / bound;
      const float here = extinction(t);
      counters.looked();
      if (here * share > bound * 1.001f) ++counters.majorantViolations;
      if (!visit(t, here, bound)) return false;
      tau = -fastLog(rng.uniformPositive());
      if (draw.share != share) {
        stop = t;
        break;
      }
    }
    t = stop;
  }
  return true;
}

/// Depth of a voxel from where on its cell is walked in parts.
inline constexpr float kThickVoxel = 16.0f;

/// Calls visit(distance, sigma_t, majorant) for the tentative collisions of a ray, drawn against
/// the local majorants in order, until it returns false: the walk that delta and ratio tracking
/// share. The majorant is the rate at which they are drawn there: that of the cell, times share
/// and density.
/// @param draw  Whole, Denser or Living
template <class Visit, class When = Still, class Draw = Whole>
inline void forEachTentative(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                             Rng& rng, TrackingCounters& counters, const Visit& visit,
                             When when = {}, const Draw& draw = {}) {
  const auto extinction = medium.alongRay(o, d, when);
  const float thick = kThickVoxel * medium.steepness();
  float tau = -fastLog(rng.uniformPositive());
  for (volume::MajorantGrid::Walk walk(medium.majorants(), o, d, 0.0f, length); !walk.done();
       walk.advance()) {
    float majorant = walk.majorant() * (draw.share * draw.density);
    const float end = walk.end();
    float t = walk.begin();
    if constexpr (std::is_same_v<When, Still>)
      if (majorant > thick) {
        if (!walkThickCell(extinction, t, end, walk.majorant(), medium.steepness(), tau, rng,
                           counters, visit, draw))
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
      counters.looked();
      if (sigma * draw.share > majorant * 1.001f) ++counters.majorantViolations;
      if (!visit(t, sigma, majorant)) return;
      tau = -fastLog(rng.uniformPositive());
      if constexpr (std::is_same_v<Draw, Living>)
        majorant = walk.majorant() * (draw.share * draw.density);
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

/// The factor of one tentative collision in a ratio-tracked transmittance, with roulette once that
/// is small.
/// @tparam Light  float, or Rgb where the channels differ
/// @return false when the ray has ended dark
template <class Light>
inline bool attenuate(Light& transmittance, const Light& sigma, float majorant, Rng& rng) {
  transmittance *= glm::max(Light(0.0f), Light(1.0f) - sigma / majorant);
  if constexpr (std::is_same_v<Light, Rgb>) transmittance *= rouletteOfFaint(transmittance, rng);
  const float factor = roulette(largestOf(transmittance), rng);
  transmittance *= factor;
  return factor > 0.0f;
}

/// How many tentative collisions a transmittance takes: as its channels need.
template <class Light>
using DrawFor = std::conditional_t<std::is_same_v<Light, float>, Whole, Living>;

/// What is left to draw once some channels may have ended.
inline void slowDown(Whole&, const Medium&, float) {}
inline void slowDown(Living& draw, const Medium& medium, const Rgb& left) {
  draw.share = glm::min(draw.share, medium.livingShare(left));
}

/// The first real collision (Woodcock delta tracking over local majorants). Where channels differ,
/// it is one of the densest: `scatter` then decides what it is for the light that arrives.
/// @param draw  Whole, or Living for the densest of the channels that carry light
template <class When = Still, class Draw = Whole>
inline Collision sampleCollision(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                                 Rng& rng, TrackingCounters& counters, When when = {},
                                 const Draw& draw = {}) {
  Collision hit;
  forEachTentative(
      medium, o, d, length, rng, counters,
      [&](float t, float sigma, float majorant) {
        const bool real = rng.uniform() * majorant < sigma * draw.share;
        if (real) hit = {t, sigma, draw.share};
        return !real;
      },
      when, draw);
  return hit;
}

/// The same for light of some power: where channels differ, one of the densest that carries any.
template <class When = Still>
inline Collision sampleCollisionOf(const Rgb& power, const Medium& medium, const Vec3f& o,
                                   const Vec3f& d, float length, Rng& rng,
                                   TrackingCounters& counters, When when = {}) {
  if (!medium.isColoured()) return sampleCollision(medium, o, d, length, rng, counters, when);
  return sampleCollision(medium, o, d, length, rng, counters, when,
                         Living{medium.livingShare(power)});
}

/// Unbiased transmittance along a ray (ratio tracking, Novak et al. 2014).
/// @tparam Light  float, or Rgb where the channels differ
template <class Light = float, class When = Still>
inline Light trackTransmittance(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                                Rng& rng, TrackingCounters& counters, When when = {}) {
  Light transmittance(1.0f);
  DrawFor<Light> draw;
  forEachTentative(
      medium, o, d, length, rng, counters,
      [&](float t, float sigma, float majorant) {
        const Light own = extinctionAs<Light>(medium, o + d * t, sigma, when);
        const bool goesOn = attenuate(transmittance, own, majorant, rng);
        slowDown(draw, medium, transmittance);
        return goesOn;
      },
      when, draw);
  return transmittance;
}

/// The part of a ray's light that meets no collision as `sampleCollisionOf` draws them, unbiased.
template <class When = Still>
inline float trackSurvivalOf(const Rgb& power, const Medium& medium, const Vec3f& o, const Vec3f& d,
                             float length, Rng& rng, TrackingCounters& counters, When when = {}) {
  if (!medium.isColoured())
    return trackTransmittance<float>(medium, o, d, length, rng, counters, when);
  float survival = 1.0f;
  const Living draw{medium.livingShare(power)};
  forEachTentative(
      medium, o, d, length, rng, counters,
      [&](float, float sigma, float majorant) {
        return attenuate(survival, sigma * draw.share, majorant, rng);
      },
      when, draw);
  return survival;
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
  DrawFor<Light> draw;
  forEachTentative(
      medium, o, d, length, rng, counters,
      [&](float t, float sigma, float majorant) {
        if (!first.happened() && rng.uniform() * majorant < sigma) first = {t, sigma};
        const Light own = extinctionAs<Light>(medium, o + d * t, sigma, when);
        // A ray that has ended dark walks on only until it has its collision.
        const bool goesOn = attenuate(transmittance, own, majorant, rng);
        if (first.happened()) slowDown(draw, medium, transmittance);
        return goesOn || !first.happened();
      },
      when, draw);
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
/// @param power  of the light, in any unit: channels without any have no part in it
template <class Light, class When = Still>
inline ForcedCollision<Light> forceCollision(const Rgb& power, const Medium& medium, const Vec3f& o,
                                             const Vec3f& d, float length, Rng& rng,
                                             TrackingCounters& counters, When when = {}) {
  constexpr float kTentative = 8.0f;  // on the mean, at least
  ForcedCollision<Light> forced;
  std::conditional_t<std::is_same_v<Light, float>, Denser, Living> draw;
  if constexpr (std::is_same_v<Light, Rgb>) {
    draw.share = medium.livingShare(power);
    forced.transmittance = glm::mix(Rgb(0.0f), Rgb(1.0f), glm::greaterThan(power, Rgb(0.0f)));
  }
  const float depth = majorantDepth(medium, o, d, length) * draw.share;
  if (!(depth > 0.0f)) return forced;
  draw.density = glm::clamp(kTentative / depth, 1.0f, 1e30f);
  float left = 1.0f;  // of the densest channel
  bool dark = false;
  forEachTentative(
      medium, o, d, length, rng, counters,
      [&](float t, float sigma, float majorant) {
        // Of what is left a part collides; of little all or nothing, so that the sum stays 1.
        const float rate = sigma * draw.share;
        float first = left * glm::min(1.0f, rate / majorant);
        if (left < kRouletteFrom) first = rng.uniform() * majorant < rate ? left : 0.0f;
        forced.weight += first;
        if (rng.uniform() * forced.weight < first) forced.hit = {t, sigma, draw.share};
        left -= first;
        if constexpr (std::is_same_v<Light, float>) {
          forced.transmittance = left;
          return left > 0.0f;
        } else {
          if (!dark)
            dark = !attenuate(forced.transmittance, medium.channels(o + d * t, sigma, when),
                              majorant, rng);
          if (!(left > 0.0f)) slowDown(draw, medium, forced.transmittance);
          return left > 0.0f || !dark;
        }
      },
      when, draw);
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
/// @param step    in the finest voxels of the medium [m]; longer where all are coarser
template <class Light = float, class When = Still>
Light marchOpticalDepth(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                        float step, When when = {});

}  // namespace photosphere::transport
