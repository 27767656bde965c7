#pragma once
// One frame made ready: medium, lights, camera and carriers in local space, and the effects that
// the frame simulates.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "photosphere/cameras/camera.h"
#include "photosphere/cameras/moving_camera.h"
#include "photosphere/core/effects.h"
#include "photosphere/core/rng.h"
#include "photosphere/estimators/light_field.h"
#include "photosphere/estimators/photon_map.h"
#include "photosphere/lights/light.h"
#include "photosphere/render/frame.h"
#include "photosphere/scene/scene_file.h"
#include "photosphere/transport/medium.h"
#include "photosphere/transport/photon_tracer.h"

namespace photosphere::scene {

/// What overrides the scene file for one run.
struct SetupOptions {
  std::optional<Vec2i> resolution;  ///< [pixels]
  std::optional<std::int64_t> seed;
  std::optional<std::int64_t>
      cacheFrame;              ///< frame of the caches, where it is not that of the picture
  bool forLightCache = false;  ///< basis auto = histogram
};

/// Whether one effect is simulated, and why.
struct EffectState {
  std::string name;  ///< as in [effects]
  bool on = false;
  std::string why;
  /// What was left out is at most this part of the mean radiance of the smoke's pixels, 0 where it
  /// is exactly nothing; nothing where all of it is simulated, or the scene switched it off.
  std::optional<double> bound = std::nullopt;
};

struct FrameSetup {
  std::string path;  ///< of the scene file, or of the first cache where there is none: for messages
  std::int64_t frame = 0;
  lights::LocalSpace space;
  Box3d worldBounds;      ///< of everything that can scatter [scene units]; empty without smoke
  bool hasSmoke = false;  ///< something scatters or glows, whether or not the plan leaves it out
  std::unique_ptr<transport::Medium> medium;  ///< never null; may be empty
  transport::LightList lights;
  std::unique_ptr<cameras::Camera> camera;  ///< at the frame
  /// The camera over the shutter; null where it stands still or that is not simulated.
  std::unique_ptr<cameras::MovingCamera> motion;
  estimators::View view;
  render::Lens lens;  ///< of radius 0 where depth of field is off
  /// Local space [m], in the order in which a point grid gives them back; carrier = "particles"
  /// alone.
  std::vector<Vec3f> particles;
  Effects effects;
  std::vector<EffectState> effectStates;
  RandomKey key;
  estimators::LightFieldLayout layout;  ///< of type `photosphere`; radius chosen where it was 0
  /// Of the light field's lattice, made once for all batches; see estimators::visibleWeights.
  std::shared_ptr<const std::vector<float>> visibleWeights;
  std::shared_ptr<const transport::PhotonGuide> guide;   ///< null = photons are not steered
  std::optional<estimators::PhotonMapLayout> photonMap;  ///< of type `photon_map`; radius chosen
  std::uint64_t photonMapPhotons = 0;                    ///< that one pass is expected to store
  /// Multiple scattering is found by paths from the lamps (estimator.type = "light_traced").
  bool lightPaths = false;
  /// Parts that photons and samples are shared out to where the frame's error is wanted: their
  /// spread tells it. More follow until it is small enough.
  int batches = 1;
  std::uint64_t photons = 0;       ///< of one batch (and of each pass of it)
  std::uint64_t memoryBudget = 0;  ///< bytes that this frame may use; 0 = no limit
  bool leftStrays = false;         ///< parts of volumes were left out as strays (volume.strays)
  double readSeconds = 0, rasterizeSeconds = 0;
  std::vector<std::string> notes;  ///< what the user should know
};

/// Reads the caches of a frame and builds everything.
/// @throws ConfigError for combinations that METHOD.md does not allow; InputMissingError,
/// InputError
///         for caches (a missing grid lists the grids that are there); MemoryError (exit 5) when
///         the smoke alone passes the budget
FrameSetup setUpFrame(const SceneFile& scene, std::int64_t frame, const SetupOptions& options = {});

/// True when the frame stores light: multiple scattering is on and the estimator keeps it.
bool storesLight(const SceneFile& scene, const FrameSetup& setup);

/// Predicted bytes of stored light. A light field: carriers times values times 12 (a 64-bit sum and
/// its float). A photon map: what building it takes, for the photons that a short trace foretells.
std::uint64_t predictedLightBytes(const FrameSetup& setup);

/// @throws MemoryError (exit 5) naming numbers and remedies when smoke, stored light and frame
///         would pass the budget
void checkMemory(const FrameSetup& setup, bool storedLight);

/// World from camera that looks at `target` from the front three-quarter, as near as keeps the
/// whole box in the frame. The front is +Z where Y is up, -Y where Z is up.
/// @param up          unit, world space
/// @param fovDegrees  horizontal
Mat4d frameBox(const Box3d& box, const Vec3d& target, const Vec3d& up, double fovDegrees,
               const Vec2i& resolution);

}  // namespace photosphere::scene
