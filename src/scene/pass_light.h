#pragma once
// The light of one pass of a frame, ready to be looked up.

#include <memory>

#include "photosphere/scene/pipeline.h"

namespace photosphere::scene {

/// How much wider the wider kernel is.
inline constexpr double kWidening = 1.5;

struct PassLight {
  using Source = std::unique_ptr<estimators::InscatterSource>;
  Source source;  ///< null where nothing asks for it
  Source wider;   ///< the same photons through a wider kernel, where that is asked for
};

/// Traces or reads the light of pass `pass` of batch `batch`. Fills the statistics of light, and
/// what the result says of its layout.
PassLight prepareLight(const SceneFile& scene, const RenderRequest& request, int batch, int pass,
                       bool wider, FrameSetup& setup, FrameResult& result);

}  // namespace photosphere::scene
