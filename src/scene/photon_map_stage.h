#pragma once
// The photon map of a frame: settings, prediction, passes.

#include "photosphere/estimators/photon_map.h"
#include "photosphere/scene/pipeline.h"

namespace photosphere::scene {

/// Fills `setup.photonMap` for estimator.type = "photon_map": settings, and the photons to expect
/// from a short trace. @throws ConfigError
void planPhotonMap(const SceneFile& scene, FrameSetup& setup);

/// Traces the map of one pass, which has photons and radius of its own, and adds up its statistics.
/// @param widening  of the radius, to see what it does
std::unique_ptr<estimators::PhotonMap> photonMapPass(const FrameSetup& setup, int pass,
                                                     double widening, FrameStatistics& statistics);

}  // namespace photosphere::scene
