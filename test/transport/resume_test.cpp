// A trace that is left off and gone on with leaves what one trace does.

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <mutex>
#include <tuple>

#include "photosphere/transport/photon_tracer.h"
#include "support/media.h"

namespace photosphere::test {
namespace {

using transport::Flight;
using transport::TraceOptions;
using transport::TraceProgress;
using transport::TraceStatistics;

using Seen = std::tuple<std::uint64_t, std::uint32_t, std::uint32_t, std::uint32_t>;

class Keeper final : public transport::FlightSink {
 public:
  void consume(std::span<const Flight> flights) override {
    const std::lock_guard lock(m_mutex);
    for (const Flight& f : flights)
      m_seen.emplace_back(f.photon, f.ordinal, std::bit_cast<std::uint32_t>(f.length),
                          std::bit_cast<std::uint32_t>(f.direction.x));
  }
  std::vector<Seen> sorted() {
    std::sort(m_seen.begin(), m_seen.end());
    return m_seen;
  }

 private:
  std::mutex m_mutex;
  std::vector<Seen> m_seen;
};

struct Stopped {};

void expectEqual(const TraceStatistics& a, const TraceStatistics& b) {
  EXPECT_EQ(a.photons, b.photons);
  EXPECT_EQ(a.flights, b.flights);
  EXPECT_EQ(a.scatterings, b.scatterings);
  EXPECT_EQ(a.emitted, b.emitted);
  EXPECT_EQ(a.absorbed, b.absorbed);
  EXPECT_EQ(a.escaped, b.escaped);
}

TEST(ResumedTrace, LeavesTheSameFlightsAndSums) {
  const transport::Medium medium =
      makeMedium(sampledVolume(1.0, 8, {.extinction = 4.0}, plumeDensity));
  const transport::LightList lights = lampsBesideAndWithin();
  TraceOptions options;
  options.photons = 700'001;
  options.firstPhoton = 1000;
  options.photonCount = 200'001;  // no multiple of what the tracer takes at once
  options.key = RandomKey::fromSeed(3, 1);
  Keeper whole;
  const TraceStatistics expected = tracePhotons(medium, lights, options, whole);

  Keeper parts;
  TraceStatistics sum;
  TraceProgress done;
  int runs = 0;
  for (bool more = true; more; ++runs) {
    options.begun = done;
    options.pause = [&](const TraceProgress& now) {
      done = now;
      if (runs < 3) throw Stopped();
    };
    try {
      sum = tracePhotons(medium, lights, options, parts);
      more = false;
    } catch (const Stopped&) {
      EXPECT_GT(done.photons, 0u);
    }
  }
  EXPECT_EQ(runs, 4);
  EXPECT_EQ(done.photons, 200'001u);
  EXPECT_EQ(whole.sorted(), parts.sorted());
  expectEqual(expected, sum);

  // What was done to its end has nothing left.
  options.begun = done;
  options.pause = {};
  Keeper nothing;
  expectEqual(expected, tracePhotons(medium, lights, options, nothing));
  EXPECT_TRUE(nothing.sorted().empty());
}

}  // namespace
}  // namespace photosphere::test
