#pragma once
// The light field of a frame: traced, or read from a light cache.

#include "photosphere/scene/pipeline.h"

namespace photosphere::scene {

/// Adds the counts and energies of photons traced to a frame's.
void addTraced(const transport::TraceStatistics& traced, FrameStatistics& statistics);

/// Fills photon counts, energies, and the seconds of tracing (or of reading a cache). Where a cache
/// is read, `setup.layout` becomes the cache's.
/// @throws what tracing and reading throw; InputError for a light cache of another medium or lights
estimators::LightField lightField(const SceneFile& scene, const RenderRequest& request,
                                  FrameSetup& setup, FrameStatistics& statistics);

/// Writes a light field with the hashes of what it was traced in. @throws OutputError
void storeLightField(const SceneFile& scene, const FrameSetup& setup,
                     const estimators::LightField& field, const std::string& path);

}  // namespace photosphere::scene
