#pragma once
// Rays through the smoke of a frame that is set up.

#include <optional>

#include "photosphere/render/integrator.h"
#include "photosphere/render/shadows.h"
#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// For one pass of a frame or several. Holds references to what it is made of.
class LayerRenderer {
 public:
  /// Tabulates shadows where the scene asks for that.
  LayerRenderer(const SceneFile& scene, const render::Crop& crop, const FrameSetup& setup);

  /// @param source  the estimator's answer; may be null
  /// @param begun   see render::FrameOptions
  render::FrameLayers render(const estimators::InscatterSource* source, int pass,
                             StateReader* begun = nullptr, const PausePoint& pause = {}) const;
  /// A part of the frame.
  render::FrameLayers renderCrop(const estimators::InscatterSource* source, int pass,
                                 const render::Crop& crop) const;
  /// `beauty` as path tracing has it, from a few paths a pixel and random numbers of its own.
  std::vector<Rgb> truth(RandomKey key) const;
  /// Rays of one pass over a crop, those of the filter's border too.
  double rays(const render::Crop& crop) const;
  /// Of shadow grids.
  std::uint64_t memoryBytes() const { return m_shadows ? m_shadows->memoryBytes() : 0; }

 private:
  render::FrameLayers render(const estimators::InscatterSource* source, int pass,
                             render::FrameOptions options) const;

  const FrameSetup& m_setup;
  bool m_paths;
  render::FrameOptions m_options;
  render::PathOptions m_path;
  render::MarchOptions m_march;
  std::optional<render::Shadows> m_shadows;
};

}  // namespace photosphere::scene
