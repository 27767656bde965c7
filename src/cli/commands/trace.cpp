// photosphere trace: photons into a light cache.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>

#include "command.h"
#include "frame_loop.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"
#include "photosphere/scene/pipeline.h"
#include "plugin_text.h"
#include "print.h"
#include "scene_options.h"
#include "stats_file.h"

namespace photosphere::cli::plugins {

namespace {

struct TraceArguments {
  SceneOptions scene;
  std::string output, shardText;
  std::optional<estimators::ShardNumber> shard;
};

std::optional<estimators::ShardNumber> parseShard(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto n = parseInts("--shard", text, '/', 2, "i/n, such as 2/16");
  if (n[0] < 1 || n[1] < 1 || n[0] > n[1] || n[1] > estimators::kMostShards)
    throw ConfigError(fmt::format("--shard {}: shards are numbered from 1/n to n/n, n at most {}",
                                  text, estimators::kMostShards));
  return estimators::ShardNumber{static_cast<std::uint64_t>(n[0]),
                                 static_cast<std::uint64_t>(n[1])};
}

void traceOne(const scene::SceneFile& scene, std::int64_t frame, const TraceArguments& options,
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

int traceFrames(const scene::SceneFile& scene, const TraceArguments& options) {
  const std::vector<std::int64_t> frames = sceneFrameList(scene, options.scene);
  checkOutputPattern(options.output, frames.size());
  const CacheFrames cacheFrames(scene, options.scene);
  JobFiles files = filesRead(scene, frames, cacheFrames);
  files.writes("-o", options.output, frames);
  files.writes("--stats", options.scene.stats, frames);
  StatsFile stats(options.scene.stats, frames.size());
  bool planned = false;
  ResumableJob job = resumableJob(scene, options.scene, "trace " + options.shardText, frames,
                                  cacheFrames, {options.output});
  const auto trace = [&](std::int64_t frame) {
    const std::string path = framePath(options.output, frame);
    if (options.scene.frames.skipExisting && vdbIsComplete(path))
      return printLine("frame {}: {} exists and is complete, skipped", frame, path);
    scene::RenderRequest request;
    request.shard = options.shard;
    std::int64_t cacheFrame = frame;
    if (!cacheFrames.map(frame, cacheFrame))
      return printLine("frame {}: outside the caches' frames, no light to trace", frame);
    if (cacheFrame != frame) request.cacheFrame = cacheFrame;
    if (options.scene.frames.dryRun) {
      if (!std::exchange(planned, true)) printPlan(scene, frame, request, true);
      return printDryRun(frame, path, cacheFrame, true);
    }
    if (job.hadFinished(frame) && vdbIsComplete(path)) {
      stats.keep(frame);
      return printLine("frame {}: {} was finished before the interruption", frame, path);
    }
    request.checkpoint = &job.begin(frame);
    traceOne(scene, frame, options, request, stats);
    job.finished(frame);
  };
  return job.run([&] {
    return runFrames(options.scene.scene, frames, options.scene.frames.keepGoing, trace);
  });
}

int runTrace(TraceArguments& options) {
  const scene::SceneFile scene = openScene(options.scene);
  if (options.scene.dumpScene) {
    printLine("{}", scene::dumpScene(scene));
    return static_cast<int>(ExitCode::ok);
  }
  options.shard = parseShard(options.shardText);
  if (options.output.empty()) throw ConfigError("no output; give -o light.vdb");
  if (std::filesystem::path(options.output).extension() != ".vdb")
    throw ConfigError(options.output + ": a light cache is written as .vdb");
  return traceFrames(scene, options);
}

std::function<int()> declareTrace(CLI::App& app) {
  auto options = std::make_shared<TraceArguments>();
  app.add_option("-o,--output", options->output, "Light cache to write, with #### for frames")
      ->type_name("LIGHT.vdb");
  addSceneOptions(app, options->scene);
  app.add_option("--shard", options->shardText,
                 "Trace part i of n of the photons; `photosphere merge` adds the parts up")
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
