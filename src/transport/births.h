#pragma once
// Where, when and whither photons set out.

#include <algorithm>
#include <array>
#include <vector>

#include "photosphere/core/sampling.h"
#include "photosphere/transport/photon_tracer.h"
#include "photosphere/transport/tracking.h"

namespace photosphere::transport {

// The R5 additive recurrence (Roberts 2018) as 64-bit fixed point: photon i takes point i, so
// births are spread evenly over lights, directions and discs whatever part of the photons a shard
// traces.
struct BirthSequence {
  std::array<std::uint64_t, 5> step{}, shift{};

  explicit BirthSequence(RandomKey key) {
    constexpr double inversePhi = 1.0 / 1.1347241384015194;  // root of x^6 = x + 1
    double alpha = 1.0;
    Rng rng(key, RandomStream::photon, ~0ull);
    for (std::size_t k = 0; k < step.size(); ++k) {
      alpha *= inversePhi;
      step[k] = static_cast<std::uint64_t>(alpha * 0x1p63) << 1;
      const std::uint64_t high = rng.bits();
      shift[k] = high << 32 | rng.bits();
    }
  }
  float operator()(std::uint64_t photon, std::size_t dimension) const {
    return static_cast<float>(bits(photon, dimension) >> 40) * 0x1p-24f;
  }
  // Fine enough to choose among more nodes than a float has values.
  double fine(std::uint64_t photon, std::size_t dimension) const {
    return static_cast<double>(bits(photon, dimension) >> 11) * 0x1p-53;
  }
  std::uint64_t bits(std::uint64_t photon, std::size_t dimension) const {
    return photon * step[dimension] + shift[dimension];
  }
};

// Chooses a source in proportion to its power: the lamps, then the medium's emission.
class SourceChoice {
 public:
  /// @param guide  gives the probabilities in place of the powers; may be null
  SourceChoice(const Medium& medium, const LightList& lights, const PhotonGuide* guide = nullptr) {
    if (guide) {
      for (const double p : guide->sources())
        m_cumulative.push_back(m_total += p);
      return;
    }
    const lights::BoundingSphere bounds = boundingSphere(medium);
    double sum = 0;
    for (const auto& light : lights) {
      sum += lights::largestPower(*light, bounds);
      m_cumulative.push_back(sum);
    }
    if (const Emission* emission = medium.emission())
      m_cumulative.push_back(sum += emission->birthPower());
    m_total = sum;
  }
  double total() const { return m_total; }
  bool dark() const { return !(m_total > 0); }
  /// @param u  of 53 bits: a float has none left for a lamp next to one that is 2^24 times as
  /// strong
  std::size_t choose(double u) const {
    const double target = u * m_total;
    const auto at = std::upper_bound(m_cumulative.begin(), m_cumulative.end(), target);
    return std::min(static_cast<std::size_t>(at - m_cumulative.begin()), m_cumulative.size() - 1);
  }
  double probability(std::size_t i) const {
    return (m_cumulative[i] - (i ? m_cumulative[i - 1] : 0.0)) / m_total;
  }

 private:
  std::vector<double> m_cumulative;
  double m_total = 0;
};

// When a photon flies: evenly spread over the shutter, along a sequence of its own (the golden
// ratio's) beside the births'.
class FlightTimes {
 public:
  FlightTimes(const Shutter& shutter, RandomKey key) : m_shutter(shutter) {
    Rng rng(key, RandomStream::photon, ~1ull);
    const std::uint64_t high = rng.bits();
    m_shift = high << 32 | rng.bits();
  }
  void of(std::uint64_t, Still&) const {}
  void of(std::uint64_t photon, Moment& when) const {
    const std::uint64_t bits = photon * 0x9e3779b97f4a7c15ull + m_shift;
    const double u = static_cast<double>(bits >> 11) * 0x1p-53;
    when.seconds = static_cast<float>(m_shutter.open + u * (m_shutter.close - m_shutter.open));
  }

 private:
  Shutter m_shutter;
  std::uint64_t m_shift;
};

// Births of a frame's photons.
class Births {
 public:
  Births(const Medium& medium, const LightList& lights, const TraceOptions& options)
      : m_medium(medium),
        m_lights(lights),
        m_guide(options.guide),
        m_bounds(boundingSphere(medium)),
        m_choice(medium, lights, options.guide),
        m_sequence(options.key) {}
  bool dark() const { return m_choice.dark(); }

  // The first flight of a photon, clipped to the medium's bounds; of length 0 where it misses them.
  template <class When>
  Flight operator()(std::uint64_t photon, Rng& rng, When when) const {
    const std::size_t source = m_choice.choose(m_sequence.fine(photon, 0));
    Flight flight;
    flight.photon = photon;
    Place place{m_sequence.fine(photon, 1), m_sequence(photon, 2)};
    float weight = 1.0f;
    if (m_guide) {
      const PhotonGuide::Drawn drawn =
          m_guide->draw(source, {place.first, static_cast<double>(place.second)});
      place = {drawn.u.x, static_cast<float>(drawn.u.y)};
      weight = drawn.weight;
    }
    if (source == m_lights.size())
      bornInSmoke(photon, place, rng, flight, when);
    else
      sentByLamp(source, photon, place, flight);
    flight.power *= weight / static_cast<float>(m_choice.probability(source));
    return flight;
  }

 private:
  // The two numbers that a guide may choose.
  struct Place {
    double first;
    float second;
  };

  template <class When>
  void bornInSmoke(std::uint64_t photon, const Place& place, Rng& rng, Flight& flight,
                   When when) const {
    const Vec2f u = rng.uniform2();
    const Emission::Birth birth = m_medium.emission()->birth(place.first, Vec3f(u, rng.uniform()));
    flight.light = kEmittedBySmoke;
    flight.power = birth.power;
    flight.origin = m_medium.moved(birth.volume, birth.origin, when);
    flight.direction = sampleSphere(Vec2f(place.second, m_sequence(photon, 3)));
    flight.length = exitDistance(m_medium, flight.origin, flight.direction);
  }

  void sentByLamp(std::size_t lamp, std::uint64_t photon, const Place& place,
                  Flight& flight) const {
    // The same 24 bits as the sequence's own floats.
    const lights::Emission birth = m_lights[lamp]->emit(
        m_bounds,
        Vec4f(rounded(place.first), place.second, m_sequence(photon, 3), m_sequence(photon, 4)));
    flight.light = static_cast<std::uint32_t>(lamp);
    flight.power = birth.power;
    const Segment inside = clipToMedium(m_medium, birth.origin, birth.direction,
                                        std::numeric_limits<double>::infinity());
    flight.origin = inside.origin;
    flight.direction = inside.direction;
    flight.length = inside.length;
  }

  static float rounded(double u) {
    return static_cast<float>(static_cast<std::uint32_t>(u * 0x1p24)) * 0x1p-24f;
  }

  const Medium& m_medium;
  const LightList& m_lights;
  const PhotonGuide* m_guide;
  lights::BoundingSphere m_bounds;
  SourceChoice m_choice;
  BirthSequence m_sequence;
};

}  // namespace photosphere::transport
