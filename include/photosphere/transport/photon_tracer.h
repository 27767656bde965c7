#pragma once
// Photon tracing into a sink (Min & Ihm 2010, section 4.1, figure 3): lamps and glowing smoke emit
// photons of equal power, each flies, collides, is absorbed or scattered by Russian roulette, one
// direction per event.

#include <bit>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "photosphere/core/rng.h"
#include "photosphere/lights/light.h"
#include "photosphere/transport/importance.h"
#include "photosphere/transport/medium.h"

namespace photosphere::transport {

/// Stands for a lamp's index where the smoke's own emission is the source.
inline constexpr std::uint32_t kEmittedBySmoke = ~0u;

/// One straight flight of a photon, from real collision (or entry) to real collision (or exit), or
/// a piece of one: where the smoke moves, pieces lie where their smoke does at the frame's own
/// time. Local space.
struct Flight {
  Vec3f origin{0.0f};
  float length = 0.0f;    ///< inside the medium's bounds [m]
  Vec3f direction{0.0f};  ///< unit
  /// sigma_t at the collision [1/m], Coefficients::extinction; 0 = the photon left
  float extinctionAtEnd = 0.0f;
  Rgb power{0.0f};                ///< whole power P per photon [W]: divide by the photon count
  std::uint32_t scatterings = 0;  ///< events before this flight; 0 = as its source sent it
  std::uint32_t light = 0;        ///< index of the lamp, or kEmittedBySmoke
  std::uint64_t photon = 0;       ///< index over all photons of the frame
  std::uint32_t ordinal = 0;      ///< number of this flight among the photon's
  float share = 1.0f;             ///< rate of collisions over sigma_t, Collision::share
  bool collided() const { return extinctionAtEnd > 0.0f; }
  /// Power of the collision [W], as if collisions came at the rate of sigma_t.
  Rgb collisionPower() const { return power / share; }
};

/// Takes flights; called from many threads at once with disjoint batches. Must not throw: the last
/// of a batch are handed over as it goes away.
class FlightSink {
 public:
  virtual ~FlightSink() = default;
  virtual void consume(std::span<const Flight> flights) = 0;
};

/// What became of the photons. Powers are per channel [W] of all the frame's light. Where photons
/// are steered, what was emitted is an estimate too, and `absorbed` holds what roulette takes less
/// what it gives.
struct TraceStatistics {
  std::uint64_t photons = 0;  ///< emitted in this run
  std::uint64_t born = 0;     ///< of these, by the smoke itself
  std::uint64_t scatterings = 0;
  std::uint64_t flights = 0;
  std::uint64_t capped = 0;  ///< photons ended by the roulette after kLongPath events
  std::uint64_t majorantViolations = 0;
  Vec3d emitted{0.0}, missed{0.0}, absorbed{0.0}, escaped{0.0}, cappedPower{0.0};
  /// emitted - missed - absorbed - escaped - capped: zero up to rounding.
  Vec3d imbalance() const { return emitted - missed - absorbed - escaped - cappedPower; }
};

/// How far a trace has got. Its flights are all in the sink.
struct TraceProgress {
  std::uint64_t photons = 0;  ///< done, from the first of the shard on
  TraceStatistics sums;       ///< of these; powers not yet divided by the frame's photons
};

struct TraceOptions {
  std::uint64_t photons = 1'000'000;  ///< of the whole frame, over all lights
  std::uint64_t firstPhoton = 0;      ///< of this shard
  std::uint64_t photonCount = ~0ull;  ///< of this shard; clipped to the frame's
  RandomKey key;
  /// Steers births and flights; nullptr = photons of equal power. Must outlive the trace.
  const PhotonGuide* guide = nullptr;
  /// What an earlier run of the same trace had done: its photons are not traced again.
  TraceProgress begun;
  /// Called about twice a second, with no flight under way; may throw InterruptedError. With it a
  /// signal ends the trace nowhere else.
  std::function<void(const TraceProgress&)> pause;
};

/// Scatterings after which a path goes on by chance. From here on every second one ends whenever
/// their number has doubled, and the other carries twice the power: unbiased, ends paths that
/// albedo 1 would never end, and leaves those that cross a slab of optical depth 1000, after some
/// hundred thousand, few enough doublings to be counted. (A roulette of survival 0.999 at every
/// event, METHOD.md section 6, leaves none of them.)
inline constexpr std::uint32_t kLongPath = 100'000;
inline bool isLongPath(std::uint32_t scatterings) {
  return scatterings >= kLongPath && scatterings % kLongPath == 0 &&
         std::has_single_bit(scatterings / kLongPath);
}

/// Traces photons of all lights and of the medium's emission, chosen in proportion to their power,
/// and hands every flight to the sink. Deterministic in everything but the order in which batches
/// reach the sink.
/// @throws InterruptedError
TraceStatistics tracePhotons(const Medium& medium, const LightList& lights,
                             const TraceOptions& options, FlightSink& sink);

/// Power that photons of a frame share [W]: of each lamp and of the emission, the largest channel.
double sharedPower(const Medium& medium, const LightList& lights);

/// Sphere around the medium's bounds: what photons are aimed at.
lights::BoundingSphere boundingSphere(const Medium& medium);

}  // namespace photosphere::transport
