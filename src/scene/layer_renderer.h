#pragma once
// Rays through the smoke of a frame that is set up.

#include <optional>

#include "photosphere/render/integrator.h"
#include "photosphere/render/light_paths.h"
#include "photosphere/render/shadows.h"
#include "photosphere/scene/frame_setup.h"
#include "photosphere/scene/pipeline.h"

namespace photosphere::scene {

/// True when estimator.samples says how many rays there are, rather than render.samples.
bool sendsPaths(const SceneFile& scene);

/// A frame without a bias.
struct Truth {
  std::vector<Rgb> beauty;
  std::uint64_t joined = 0;  ///< collisions of photons that are in it; 0 where none were sent
};

/// For one pass of a frame or several. Holds references to what it is made of.
class LayerRenderer {
 public:
  /// Tabulates shadows where the scene asks for that.
  LayerRenderer(const SceneFile& scene, const render::Crop& crop, const FrameSetup& setup);

  /// @param source  the estimator's answer; may be null
  /// @param begun   see render::FrameOptions
  render::FrameLayers render(const estimators::InscatterSource* source, int pass,
                             StateReader* begun = nullptr, const PausePoint& pause = {}) const;
  /// `multiple` as paths from the lamps have it. Fills photon counts, energies and the seconds of
  /// tracing.
  /// @param part  tells the parts of a frame apart in its checkpoint
  std::vector<Rgb> lightPaths(Checkpoint* checkpoint, std::uint64_t part,
                              FrameStatistics& statistics) const;
  /// A part of the frame.
  render::FrameLayers renderCrop(const estimators::InscatterSource* source, int pass,
                                 const render::Crop& crop) const;
  /// From a few paths a pixel and random numbers of its own.
  /// @param fromLamps  what scatters more than once by as many paths from the lamps
  Truth truth(RandomKey key, bool fromLamps) const;
  /// Rays of one pass over a crop, those of the filter's border too.
  double rays(const render::Crop& crop) const;
  /// Of shadow grids.
  std::uint64_t memoryBytes() const { return m_shadows ? m_shadows->memoryBytes() : 0; }

 private:
  render::LightPaths lightPaths(render::LightPathOptions options) const;
  render::FrameLayers render(const estimators::InscatterSource* source, int pass,
                             render::FrameOptions options) const;

  const FrameSetup& m_setup;
  bool m_paths;  // from the eye; with those from the lamps, for light that scattered once
  render::FrameOptions m_options;
  render::PathOptions m_path;
  render::MarchOptions m_march;
  std::optional<render::Shadows> m_shadows;
};

}  // namespace photosphere::scene
