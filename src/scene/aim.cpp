#include "aim.h"

#include <fmt/format.h>

#include "blur.h"
#include "photosphere/render/view_importance.h"

namespace photosphere::scene {

namespace {

// Steering costs a few hundredths of a second and the splitting of photons. It pays where less than
// these parts of the smoke are in the frame, or of the lamps' light meet smoke (README.md).
constexpr double kVisible = 0.5, kHitting = 0.2;

// True when light is read only where the camera's own rays pass.
bool readAlongRays(const SceneFile& scene, const FrameSetup& setup) {
  return scene.estimator.text("type") == "photosphere" && scene.estimator.text("cache").empty() &&
         setup.layout.carrier == estimators::Carrier::voxels &&
         scene.estimator.integer("final_gather") == 0;
}

}  // namespace

void aimLight(const SceneFile& scene, const render::Crop& crop, FrameSetup& setup) {
  const transport::Medium& medium = *setup.medium;
  const bool traces =
      setup.lightPaths || (storesLight(scene, setup) && scene.estimator.text("cache").empty());
  // A lens and a shutter look around the frame's edges.
  const bool fixed = setup.lens.radius == 0 && !medium.isMoving() && !setup.motion;
  if (!traces || !fixed || medium.bounds().empty()) return;
  // What is kept changes no pixel, so it goes by the crop. What is steered does: by the whole
  // frame.
  if (readAlongRays(scene, setup)) setup.view.planes = seenPlanes(scene, setup, crop);

  const std::string& wish = scene.estimator.text("importance");
  if (wish == "off") return;
  const render::Crop frame{Vec2i(0), setup.camera->resolution()};
  const double visible = render::visibleShare(medium, seenPlanes(scene, setup, frame));
  const double hitting = render::hittingShare(medium, setup.lights);
  if (wish == "auto" && visible >= kVisible && hitting >= kHitting) return;
  auto guide = std::make_shared<transport::PhotonGuide>(
      medium, setup.lights,
      render::viewImportance(*setup.camera, frame, setup.space, medium, setup.key));
  if (!guide->useful()) return;
  setup.guide = std::move(guide);
  setup.notes.push_back(
      fmt::format("photons go where the picture gains from them: {:.0f} % of the smoke is in the "
                  "frame, {:.0f} % of the lamps' light meets smoke (estimator.importance)",
                  100 * visible, 100 * hitting));
}

}  // namespace photosphere::scene
