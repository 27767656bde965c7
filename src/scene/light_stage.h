#pragma once
// The light field of a frame: traced, or read from a light cache.

#include "photosphere/scene/pipeline.h"

namespace photosphere::scene {

/// Flights that leave light in a field: every one after a scattering or from the smoke's own
/// emission, and the first one of a lamp where lamps with extent are kept.
std::uint64_t storedPhotons(const estimators::LightFieldLayout& layout,
                            const transport::TraceStatistics& traced);

/// Adds the counts and energies of photons traced to a frame's.
void addTraced(const transport::TraceStatistics& traced, FrameStatistics& statistics);

/// Fills photon counts, energies, and the seconds of tracing (or of reading a cache). Where a cache
/// is read, `setup.layout` becomes the cache's.
/// @param part  tells the parts of a frame apart in its checkpoint
/// @throws what tracing and reading throw; InputError for a light cache of another medium or lights
estimators::LightField lightField(const SceneFile& scene, const RenderRequest& request,
                                  FrameSetup& setup, FrameStatistics& statistics,
                                  std::uint64_t part = 0);

/// The sums of the photons that the request asks for: all, or one shard's.
estimators::LightSums lightSums(const RenderRequest& request, FrameSetup& setup,
                                FrameStatistics& statistics, transport::TraceStatistics& traced,
                                std::uint64_t part = 0);

/// What light belongs to.
estimators::LightCacheKey lightKey(const SceneFile& scene, const FrameSetup& setup);

}  // namespace photosphere::scene
