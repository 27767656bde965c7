// photosphere render: frames of a scene, or of a bare cache.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>

#include "command.h"
#include "frame_loop.h"
#include "number_check.h"
#include "photosphere/core/error.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"
#include "photosphere/image/exr.h"
#include "photosphere/scene/plan.h"
#include "plugin_text.h"
#include "print.h"
#include "scene_options.h"
#include "stats_file.h"

namespace photosphere::cli::plugins {

namespace {

struct RenderArguments {
  SceneOptions scene;
  std::optional<double> targetError, timeLimit;
  std::string output, crop, compression = "zip";
  scene::WriteRequest write;
};

/// -o, else output.file. @throws ConfigError
std::string chooseOutput(const scene::SceneFile& scene, const std::string& option) {
  std::string path = option.empty() ? scene.resolvePath(scene.output.text("file")) : option;
  if (path.empty())
    throw ConfigError("no output; give -o beauty.####.exr, or output.file in the scene");
  if (std::filesystem::path(path).extension() != ".exr")
    throw ConfigError(fmt::format("{}: frames are written as .exr; --preview writes PNG", path));
  return path;
}

std::optional<render::Crop> parseCrop(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto c = parseInts("--crop", text, ',', 4, "X0,Y0,X1,Y1 in pixels, X1 and Y1 exclusive");
  const render::Crop crop{{c[0], c[1]}, {c[2], c[3]}};
  if (crop.max.x <= crop.min.x || crop.max.y <= crop.min.y)
    throw ConfigError(fmt::format("command line: --crop '{}' is empty", text));
  return crop;
}

// @return false where target_error was missed
bool renderOne(const scene::SceneFile& scene, std::int64_t frame, RenderArguments& options,
               const scene::RenderRequest& request, const scene::FrameWriter& writer,
               StatsFile& stats) {
  checkWritable(framePath(options.write.path, frame));
  checkWritable(framePath(options.write.preview, frame));
  checkWritable(framePath(options.scene.stats, frame));
  scene::FrameResult result = scene::renderScene(scene, frame, request);
  log::info("frame {}: plan: {}", frame, scene::planLine(result.statistics.effects));
  for (const std::string& note : result.notes)
    log::info("frame {}: {}", frame, note);
  for (const std::string& warning : result.warnings)
    log::warning("frame {}: {}", frame, warning);
  const InterruptDelay delay;  // what is rendered is written
  writer.write(result);
  const scene::FrameStatistics& s = result.statistics;
  const std::string path = framePath(options.write.path, frame);
  printLine("frame {}: {}  mean {:.6g}, max {:.6g}  {}  peak {}", frame, path, s.imageMean,
            s.imageMax, formatSeconds(s.seconds), formatBytes(s.peakMemoryBytes));
  stats.add(frame, path, s);
  return !s.targetMissed;
}

/// @throws ConfigError where a frame would be written over what the job reads, or over another file
void checkOverwriting(const scene::SceneFile& scene, const scene::FrameWriter& writer,
                      const RenderArguments& options, const std::vector<std::int64_t>& frames,
                      const CacheFrames& cacheFrames) {
  JobFiles files = filesRead(scene, frames, cacheFrames);
  files.reads("the OCIO config", writer.colorConfig());
  files.writes(options.output.empty() ? "output.file" : "-o", options.write.path, frames);
  files.writes("the preview", options.write.preview, frames);
  files.writes("--stats", options.scene.stats, frames);
}

int renderFrames(const scene::SceneFile& scene, const scene::FrameWriter& writer,
                 RenderArguments& options) {
  const std::vector<std::int64_t> frames = sceneFrameList(scene, options.scene);
  checkOutputPattern(options.write.path, frames.size());
  if (!options.write.preview.empty()) checkOutputPattern(options.write.preview, frames.size());
  const CacheFrames cacheFrames(scene, options.scene);
  checkOverwriting(scene, writer, options, frames, cacheFrames);
  scene::SceneFile empty = scene;
  empty.volumes.clear();
  StatsFile stats(options.scene.stats, frames.size());
  bool planned = false;
  const scene::WriteRequest& write = options.write;
  JobFiles colour;
  colour.reads("the OCIO config", writer.colorConfig());
  const std::string config = colour.stamp("");
  const std::string more = fmt::format(
      "render {} {} {} {} {} {} {} {} {}", options.crop, write.floatColor, options.compression,
      write.preview, write.exposure, write.ocioConfig, write.ocioDisplay, write.ocioView, config);
  ResumableJob job =
      resumableJob(scene, options.scene, more, frames, cacheFrames, {write.path, write.preview});
  const auto render = [&](std::int64_t frame) {
    const std::string path = framePath(options.write.path, frame);
    if (options.scene.frames.skipExisting && image::exrIsComplete(path))
      return printLine("frame {}: {} exists and is complete, skipped", frame, path);
    scene::RenderRequest request;
    request.crop = parseCrop(options.crop);
    request.allowStale = options.scene.allowStale;
    std::int64_t cacheFrame = frame;
    const bool smoke = cacheFrames.map(frame, cacheFrame);
    if (cacheFrame != frame) request.cacheFrame = cacheFrame;
    if (options.scene.frames.dryRun) {
      if (smoke && !std::exchange(planned, true)) printPlan(scene, frame, request, false);
      return printDryRun(frame, path, cacheFrame, smoke);
    }
    if (job.hadFinished(frame) && image::exrIsComplete(path)) {
      stats.keep(frame);
      return printLine("frame {}: {} was finished before the interruption", frame, path);
    }
    if (!smoke)
      log::info("frame {}: without smoke: outside the caches' frames (--cache-hold clip)", frame);
    request.checkpoint = &job.begin(frame);
    const bool reached = renderOne(smoke ? scene : empty, frame, options, request, writer, stats);
    job.finished(frame, !reached);
  };
  const int code = job.run([&] {
    return runFrames(options.scene.scene, frames, options.scene.frames.keepGoing, render);
  });
  if (code != static_cast<int>(ExitCode::ok) || !job.missed()) return code;
  return static_cast<int>(ExitCode::accuracy);
}

int runRender(RenderArguments& options) {
  parseCrop(options.crop);
  options.write.compression = image::parseExrCompression(options.compression);
  // After -s: the option that is more explicit wins.
  if (options.targetError)
    options.scene.sets.push_back(fmt::format("render.target_error={}", *options.targetError));
  if (options.timeLimit)
    options.scene.sets.push_back(fmt::format("render.time_limit={}", *options.timeLimit));
  const scene::SceneFile scene = openScene(options.scene);
  if (options.scene.dumpScene) {
    printLine("{}", scene::dumpScene(scene));
    return static_cast<int>(ExitCode::ok);
  }
  options.write.path = chooseOutput(scene, options.output);
  if (options.write.preview.empty())
    options.write.preview = scene.resolvePath(scene.output.text("preview"));
  return renderFrames(scene, scene::FrameWriter(scene, options.write), options);
}

std::string sceneHelp() {
  return "Keys of a scene file, which -s/--set overrides:\n" + describeScene() +
         describeEstimators() + "\nCameras:\n" + describeCameras() + "\nLights:\n" +
         describeLights() + "\nPhase functions:\n" + describePhases();
}

std::function<int()> declareRender(CLI::App& app) {
  auto options = std::make_shared<RenderArguments>();
  app.add_option("-o,--output", options->output, "EXR to write, with #### for several frames")
      ->type_name("OUT.exr");
  addSceneOptions(app, options->scene);
  app.add_option("--target-error", options->targetError,
                 "Go on until the estimated relative error is below; replaces render.target_error")
      ->check(finiteNumber({.least = 0}))
      ->type_name("E");
  app.add_option("--time-limit", options->timeLimit, "Seconds a frame; replaces render.time_limit")
      ->check(finiteNumber({.least = 0}))
      ->type_name("S");
  const char* group = "Image";
  app.add_option("--crop", options->crop, "Part of the frame in pixels, X1 and Y1 exclusive")
      ->type_name("X0,Y0,X1,Y1")
      ->group(group);
  app.add_flag("--float", options->write.floatColor, "Colour as 32-bit float; else half")
      ->group(group);
  app.add_option("--compression", options->compression,
                 "none, rle, zips, zip, piz, dwaa, dwab [zip]")
      ->type_name("NAME")
      ->group(group);
  app.add_option("--preview", options->write.preview, "PNG or JPEG for people beside the EXR")
      ->type_name("OUT.png")
      ->group(group);
  app.add_option("--exposure", options->write.exposure, "Of the preview, in stops [0]")
      ->check(finiteNumber({.least = -100, .most = 100}))
      ->type_name("STOPS")
      ->group(group);
  app.add_option("--ocio", options->write.ocioConfig,
                 "OpenColorIO config [$OCIO, else the one shipped]")
      ->type_name("FILE")
      ->group(group);
  app.add_option("--ocio-display", options->write.ocioDisplay, "Display of the preview")
      ->type_name("NAME")
      ->group(group);
  app.add_option("--ocio-view", options->write.ocioView, "View of the preview")
      ->type_name("NAME")
      ->group(group);
  app.footer([] { return sceneHelp(); });
  return [options] { return runRender(*options); };
}

}  // namespace

extern const Command render;
const Command render = {
    "render", "Render frames of a scene, or of a cache for which one is made up", declareRender};

}  // namespace photosphere::cli::plugins
