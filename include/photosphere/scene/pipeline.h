#pragma once
// From a scene to a frame: set-up, light field, resolve, shadows, march, file.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "photosphere/core/checkpoint.h"
#include "photosphere/core/error.h"
#include "photosphere/estimators/light_shard.h"
#include "photosphere/image/color.h"
#include "photosphere/image/exr.h"
#include "photosphere/image/image.h"
#include "photosphere/image/preview.h"
#include "photosphere/render/frame.h"
#include "photosphere/scene/frame_error.h"
#include "photosphere/scene/frame_setup.h"
#include "photosphere/scene/scene_file.h"

namespace photosphere::scene {

/// What a command line asks for beside the scene. The number of threads is core's ThreadLimit.
struct RenderRequest {
  std::optional<Vec2i> resolution;   ///< [pixels]; replaces camera.resolution
  std::optional<render::Crop> crop;  ///< [pixels], clipped to the frame
  std::optional<std::int64_t> seed;
  std::optional<std::int64_t> cacheFrame;  ///< frame of the caches, where it differs
  bool allowStale = false;                 ///< use a light cache made for another medium or lights
  std::optional<estimators::ShardNumber> shard;  ///< traceScene: these photons alone
  Checkpoint* checkpoint = nullptr;              ///< goes on from it, and keeps what is done in it
};

/// Wall-clock seconds of each stage.
struct StageSeconds {
  double read = 0, rasterize = 0, trace = 0, resolve = 0, march = 0, write = 0, total = 0;
  double check = 0;  ///< paths that a frame with a target error is held against
};

/// What --stats and the EXR header report.
struct FrameStatistics {
  StageSeconds seconds;
  double cpuSeconds = 0;
  std::uint64_t peakMemoryBytes = 0;
  std::uint64_t photonsEmitted = 0, photonsScattered = 0, photonsStored = 0, photonsCapped = 0;
  std::uint64_t lightMemoryBytes = 0;  ///< light field or photon map, the largest of all passes
  /// Per channel [W].
  Vec3d energyEmitted{0.0}, energyMissed{0.0}, energyAbsorbed{0.0}, energyEscaped{0.0},
      energyCapped{0.0}, energyError{0.0};
  std::uint64_t nanSamples = 0, negativeSamples = 0, majorantViolations = 0;
  double negativeLight = 0;        ///< InscatterSource::negativeShare
  std::uint64_t pathsCapped = 0;   ///< ended by max_scatter, from either end
  double pathsCappedRadiance = 0;  ///< throughput they still carried, summed
  std::vector<EffectState> effects;
  std::optional<ErrorEstimate> error;  ///< where render.target_error or time_limit asks for it
  int batches = 1;                     ///< independent parts that the frame is the mean of
  bool targetMissed = false;           ///< target_error was not reached (exit 7)
  double imageMean = 0, imageMax = 0;  ///< of R, G, B [W m^-2 sr^-1]
  std::string sceneHash, mediumHash;
};

/// One rendered frame and all that its file says about it.
struct FrameResult {
  std::int64_t frame = 0;
  render::FrameLayers layers;
  FrameStatistics statistics;
  std::vector<Rgb> error;               ///< standard error of `beauty`, where it is estimated
  std::vector<std::string> layerNames;  ///< layers this frame has, by their names in output.aovs
  Mat4d cameraFromWorld{1.0};
  std::optional<Mat4d> ndcFromWorld;  ///< nothing for a panorama
  double framesPerSecond = 24;
  std::string estimator;  ///< estimator.type
  std::string layout;     ///< one line: how light is stored; empty where none is
  double radius = 0;      ///< of the spatial kernel, of the first pass [scene units]; 0 without
  std::int64_t seed = 0;
  std::vector<std::string> notes;
  std::vector<std::string> warnings;  ///< what is hardly meant: that the frame is black
};

/// A frame that holds what no picture may.
class SampleError : public Error {
 public:
  SampleError(const std::string& message, std::uint64_t nans, std::uint64_t negatives)
      : Error(ExitCode::unspecified, message), m_nans(nans), m_negatives(negatives) {}
  std::uint64_t nans() const { return m_nans; }  ///< samples that are NaN or infinite
  std::uint64_t negatives() const { return m_negatives; }

 private:
  std::uint64_t m_nans, m_negatives;
};

/// Renders one frame.
/// @throws what setUpFrame throws; MemoryError before tracing; SampleError naming the first pixel
///         when a sample is NaN or negative; InterruptedError
FrameResult renderScene(const SceneFile& scene, std::int64_t frame,
                        const RenderRequest& request = {});

/// Where and how a frame is written.
struct WriteRequest {
  std::string path;     ///< EXR; frame tokens are replaced
  std::string preview;  ///< PNG or JPEG; empty = none; frame tokens are replaced
  bool floatColor = false;
  image::ExrCompression compression = image::ExrCompression::zip;
  std::string ocioConfig, ocioDisplay, ocioView;  ///< empty = defaults (image/color.h)
  float exposure = 0;                             ///< of the preview [stops]
};

/// Layers as image channels: R, G, B, A for `beauty`, `single.R`..., `Z` for `depth`.
/// @param aovs  names of output.aovs, of which those that the frame lacks are zeros; empty = all of
///              `layerNames`. @throws ConfigError for others
image::Image frameImage(const FrameResult& result, const std::vector<std::string>& aovs);

/// Writes the frames of a scene as EXR and preview.
class FrameWriter {
 public:
  /// Finds out before the work what is wrong with colour config, spaces, display and kind of
  /// preview.
  /// @throws ConfigError, InputMissingError, InputError
  FrameWriter(const SceneFile& scene, WriteRequest request);
  /// Sets statistics.seconds.write and adds it to the total.
  /// @throws OutputError
  void write(FrameResult& result) const;
  /// Path of the colour config.
  const std::string& colorConfig() const { return m_config.source(); }

 private:
  WriteRequest m_request;
  std::vector<std::string> m_layers;  // output.aovs
  image::ColorConfig m_config;
  std::optional<image::Chromaticities> m_chromaticities;
  image::DisplayOptions m_display;
};

/// The object of `--stats` as JSON text with a final newline. Always valid JSON: what is not finite
/// is null.
std::string statsJson(const FrameStatistics& statistics);

/// Traces the light of a frame into a light cache, or into one shard of it (`photosphere trace`).
/// @param output  .vdb; frame tokens are replaced
/// @return statistics of that frame
FrameStatistics traceScene(const SceneFile& scene, std::int64_t frame, const std::string& output,
                           const RenderRequest& request = {});

/// Adds up the shards of a light cache (`photosphere merge`). @throws what mergeLightShards throws;
/// OutputError
/// @return what became of the photons; what the user should know goes to `notes`
FrameStatistics mergeShards(const std::vector<std::filesystem::path>& shards,
                            const std::string& output, std::vector<std::string>& notes);

/// The frames that a scene asks for: scene.frames, else {1}.
std::vector<std::int64_t> sceneFrames(const SceneFile& scene);

}  // namespace photosphere::scene
