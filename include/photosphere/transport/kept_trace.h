#pragma once
// Traces that a checkpoint may hold part of.

#include <cstdint>
#include <functional>

#include "photosphere/core/checkpoint.h"
#include "photosphere/transport/photon_tracer.h"

namespace photosphere::transport {

/// Where a trace is kept, and what its sink has gathered.
struct TraceKeeping {
  Checkpoint* checkpoint = nullptr;  ///< null = nothing is kept
  std::uint64_t part = 0;            ///< tells the traces of a frame apart
  std::function<void(StateWriter&)> keep;
  std::function<void(StateReader&)> resume;
};

/// The same as tracePhotons, going on from what an earlier run has kept. `options.begun` and
/// `pause` are set here.
/// @throws InterruptedError
TraceStatistics tracePhotons(const Medium& medium, const LightList& lights, TraceOptions options,
                             FlightSink& sink, const TraceKeeping& keeping);

}  // namespace photosphere::transport
