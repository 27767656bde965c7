#pragma once
// The light and the rays of a frame: once, or in parts whose spread tells the frame's error.

#include "photosphere/core/resources.h"
#include "photosphere/scene/pipeline.h"

namespace photosphere::scene {

/// Fills `result.layers` and the statistics of light and march. The frame is rendered in
/// `setup.batches` parts, each of photons, samples and random numbers of its own, and goes on until
/// its error or the time is what render.target_error and time_limit ask for. Notes go to
/// `setup.notes`.
/// @param crop   [pixels], inside the frame
/// @param watch  runs since the frame was begun
void renderBatches(const SceneFile& scene, const RenderRequest& request, const render::Crop& crop,
                   const Stopwatch& watch, FrameSetup& setup, FrameResult& result);

}  // namespace photosphere::scene
