// photosphere trace: photons into a light cache.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "command.h"
#include "frame_loop.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"
#include "photosphere/scene/pipeline.h"
#include "photosphere/volume/vdb_file.h"
#include "plugin_text.h"
#include "print.h"
#include "scene_options.h"
#include "stats_file.h"

namespace photosphere::cli::plugins {

namespace {

struct Options {
  SceneOptions scene;
  std::string output;
};

bool isComplete(const std::string& path) {
  std::string reason;
  return std::filesystem::is_regular_file(path) && volume::probeVdb(path, reason);
}

void traceOne(const scene::SceneFile& scene, std::int64_t frame, const Options& options,
              const scene::RenderRequest& request, StatsFile& stats) {
  const std::string path = framePath(options.output, frame);
  checkWritable(path);
  checkWritable(framePath(options.scene.stats, frame));
  const scene::FrameStatistics s = scene::traceScene(scene, frame, options.output, request);
  printLine("frame {}: {}  photons {} emitted, {} scattered, {} stored  {}  peak {}", frame, path,
            s.photonsEmitted, s.photonsScattered, s.photonsStored, formatSeconds(s.seconds),
            formatBytes(s.peakMemoryBytes));
  stats.add(frame, path, s);
}

int traceFrames(const scene::SceneFile& scene, const Options& options) {
  const std::vector<std::int64_t> frames = sceneFrameList(scene, options.scene);
  checkOutputPattern(options.output, frames.size());
  const CacheFrames cacheFrames(scene, options.scene);
  StatsFile stats(options.scene.stats, frames.size());
  bool planned = false;
  return runFrames(frames, options.scene.frames.keepGoing, [&](std::int64_t frame) {
    const std::string path = framePath(options.output, frame);
    if (options.scene.frames.skipExisting && isComplete(path))
      return printLine("frame {}: {} exists and is complete, skipped", frame, path);
    scene::RenderRequest request;
    std::int64_t cacheFrame = frame;
    if (!cacheFrames.map(frame, cacheFrame))
      return printLine("frame {}: outside the caches' frames, no light to trace", frame);
    if (cacheFrame != frame) request.cacheFrame = cacheFrame;
    if (!options.scene.frames.dryRun) return traceOne(scene, frame, options, request, stats);
    if (!std::exchange(planned, true)) printPlan(scene, frame, request, true);
    printDryRun(frame, path, cacheFrame, true);
  });
}

int runTrace(const Options& options) {
  const scene::SceneFile scene = openScene(options.scene);
  if (options.scene.dumpScene) {
    printLine("{}", scene::dumpScene(scene));
    return static_cast<int>(ExitCode::ok);
  }
  if (options.output.empty()) throw ConfigError("no output; give -o light.vdb");
  if (std::filesystem::path(options.output).extension() != ".vdb")
    throw ConfigError(options.output + ": a light cache is written as .vdb");
  return traceFrames(scene, options);
}

std::function<int()> declareTrace(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("-o,--output", options->output, "Light cache to write, with #### for frames")
      ->type_name("LIGHT.vdb");
  addSceneOptions(app, options->scene);
  app.add_option("--shard", options->scene.shard, "Part i of n of the photons (not served yet)")
      ->type_name("i/n");
  app.footer([] {
    return "Keys of the estimator, which -s/--set overrides (all keys: photosphere render "
           "--help):\n" +
           describeEstimators();
  });
  return [options] { return runTrace(*options); };
}

}  // namespace

extern const Command trace;
const Command trace = {"trace", "Trace photons into a light cache that renders can share",
                       declareTrace};

}  // namespace photosphere::cli::plugins
