#include "photosphere/transport/kept_trace.h"

#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"

namespace photosphere::transport {

namespace {

constexpr const char* kPart = "light";
// Light that took less to trace is traced again rather than kept [s].
constexpr double kWorthKeeping = 1.0;

}  // namespace

TraceStatistics tracePhotons(const Medium& medium, const LightList& lights, TraceOptions options,
                             FlightSink& sink, const TraceKeeping& keeping) {
  if (!keeping.checkpoint) return tracePhotons(medium, lights, options, sink);
  TraceProgress progress;
  double secondsBefore = 0;  // of earlier runs
  const Stopwatch watch;
  const WriteState write = [&](StateWriter& w) {
    w.value(keeping.part);
    w.value(progress);
    w.value(secondsBefore + watch.seconds());
    keeping.keep(w);
  };
  if (auto kept = keeping.checkpoint->load(kPart);
      kept && kept->value<std::uint64_t>() == keeping.part) {
    kept->value(progress);
    kept->value(secondsBefore);
    keeping.resume(*kept);
    log::info("light goes on from {} photons, which {:.1f} s have traced", progress.photons,
              secondsBefore);
  }
  options.begun = progress;
  options.pause = [&](const TraceProgress& done) {
    progress = done;
    keeping.checkpoint->offer(kPart, write);
  };
  const TraceStatistics statistics = tracePhotons(medium, lights, options, sink);
  // What comes next keeps the picture, not the light that it is made from.
  if (watch.seconds() > kWorthKeeping) keeping.checkpoint->save(kPart, write);
  return statistics;
}

}  // namespace photosphere::transport
