#include "black_frame.h"

#include <algorithm>

namespace photosphere::scene {

namespace {

// What the plan says of light that no effect is left to carry.
std::string whyUnlit(const SceneFile& scene, const FrameSetup& setup) {
  if (scene.effects.text("single_scattering") == "off")
    return "effects.single_scattering is off, and nothing else is lit";
  for (const EffectState& effect : setup.effectStates)
    if (effect.name == "single_scattering") return effect.why;
  return "nothing is lit";
}

}  // namespace

bool isBlack(const render::FrameLayers& layers) {
  return std::all_of(layers.beauty.begin(), layers.beauty.end(),
                     [](const Rgb& pixel) { return pixel == Rgb(0.0f); });
}

std::string whyBlack(const SceneFile& scene, const FrameSetup& setup,
                     const render::FrameLayers& layers) {
  if (!setup.hasSmoke) return "no volume holds smoke at this frame (or its density_scale is 0)";
  const bool seen =
      std::any_of(layers.alpha.begin(), layers.alpha.end(), [](float alpha) { return alpha > 0; });
  if (!seen)
    return "no smoke is in view (camera.position, look_at and near, or the crop, leave it out)";
  const Effects& e = setup.effects;
  if (!e.singleScattering && !e.multipleScattering && !e.emission) return whyUnlit(scene, setup);
  return "no light reaches what is in view";
}

}  // namespace photosphere::scene
