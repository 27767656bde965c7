// photosphere merge: shards of a light cache into the light cache.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "command.h"
#include "frame_loop.h"
#include "job_files.h"
#include "options.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"
#include "photosphere/scene/pipeline.h"
#include "print.h"
#include "stats_file.h"

namespace photosphere::cli::plugins {

namespace {

struct MergeArguments {
  std::vector<std::string> shards;
  std::string output, stats;
  FrameOptions frames;
};

/// --frames, else the frames that the first numbered shard has, else 1.
std::vector<std::int64_t> frameList(const MergeArguments& options) {
  if (!options.frames.frames.empty()) return parseFrames(options.frames.frames);
  for (const std::string& shard : options.shards)
    if (hasFrameToken(shard)) return framesByFiles(shard);
  return {1};
}

void mergeOne(const MergeArguments& options, std::int64_t frame, StatsFile& stats) {
  const std::string path = framePath(options.output, frame);
  std::vector<std::filesystem::path> shards;
  for (const std::string& shard : options.shards)
    shards.emplace_back(framePath(shard, frame));
  if (options.frames.dryRun) return printLine("frame {}: {}", frame, path);
  checkWritable(path);
  std::vector<std::string> notes;
  const scene::FrameStatistics s = scene::mergeShards(shards, path, notes);
  for (const std::string& note : notes)
    log::warning("{}: {}", path, note);
  printLine("frame {}: {}  {} shards, {} photons emitted, {} scattered  total {:.2f} s  peak {}",
            frame, path, shards.size(), s.photonsEmitted, s.photonsScattered, s.seconds.total,
            formatBytes(s.peakMemoryBytes));
  stats.add(frame, path, s);
}

int runMerge(const MergeArguments& options) {
  if (std::filesystem::path(options.output).extension() != ".vdb")
    throw ConfigError(options.output + ": a light cache is written as .vdb");
  const std::vector<std::int64_t> frames = frameList(options);
  checkOutputPattern(options.output, frames.size());
  JobFiles files;
  for (const std::string& shard : options.shards)
    files.reads("SHARD", shard, frames);
  files.writes("-o", options.output, frames);
  files.writes("--stats", options.stats, frames);
  StatsFile stats(options.stats, frames.size());
  return runFrames(options.output, frames, options.frames.keepGoing, [&](std::int64_t frame) {
    const std::string path = framePath(options.output, frame);
    if (options.frames.skipExisting && vdbIsComplete(path))
      return printLine("frame {}: {} exists and is complete, skipped", frame, path);
    mergeOne(options, frame, stats);
  });
}

std::function<int()> declareMerge(CLI::App& app) {
  auto options = std::make_shared<MergeArguments>();
  app.add_option("SHARD", options->shards,
                 "Every shard of `photosphere trace --shard i/n`, in any order, with #### for "
                 "frames")
      ->type_name("SHARD.vdb...")
      ->required();
  app.add_option("-o,--output", options->output, "Light cache to write, with #### for frames")
      ->type_name("LIGHT.vdb")
      ->required();
  app.add_option("--stats", options->stats, "Statistics as JSON")->type_name("FILE.json");
  addFrameOptions(app, options->frames);
  return [options] { return runMerge(*options); };
}

}  // namespace

extern const Command merge;
const Command merge = {"merge", "Add up the shards of a light cache", declareMerge};

}  // namespace photosphere::cli::plugins
