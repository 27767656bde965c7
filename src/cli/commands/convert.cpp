// photosphere convert: simulation caches to VDB points and grids, and back.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "command.h"
#include "convert_frame.h"
#include "frame_loop.h"
#include "job_files.h"
#include "number_check.h"
#include "options.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/log.h"
#include "photosphere/volume/vdb_file.h"
#include "print.h"

namespace photosphere::cli::plugins {

namespace {

struct ConvertArguments {
  std::vector<std::string> inputs;
  std::string output, origin = "0,0,0";
  std::vector<std::string> formatOptions;
  FrameOptions frames;
  ConvertOptions convert;
};

std::string formatHelp() {
  std::string text = "Options of formats (--format-option NAME=VALUE):\n";
  for (const caches::CacheFormat* format : caches::cacheFormats())
    if (!format->params.empty())
      text += fmt::format("  {}\n{}", format->name, formatParams(format->params, 4));
  return text +
         "\nParticles become points and a density grid: mass = `mass`, else density * 4/3 pi "
         "pscale^3,\nelse 1; density = mass / volume. A density grid of the input is kept as it "
         "is.";
}

/// Frames to convert: asked for, or found for the first numbered input.
/// @throws InputMissingError when the pattern has no file
std::vector<std::int64_t> chooseFrames(const ConvertArguments& options) {
  const auto numbered = std::find_if(options.inputs.begin(), options.inputs.end(),
                                     [](const std::string& path) { return hasFrameToken(path); });
  if (!options.frames.frames.empty()) {
    if (numbered == options.inputs.end() && !hasFrameToken(options.output))
      throw ConfigError(
          "--frames needs #### in the input path, where the frame number belongs "
          "(such as smoke.####.vdb)");
    return parseFrames(options.frames.frames);
  }
  if (numbered == options.inputs.end()) return {1};
  return framesByFiles(*numbered);
}

bool isComplete(const std::string& path) {
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(path, unknown)) return false;
  std::string reason;
  try {
    const caches::CacheFormat& format = caches::detectFormat(path);
    if (format.name == "vdb") return volume::probeVdb(path, reason);
    if (format.read) format.read(path, ParamValues(format.params));
    return true;
  } catch (const Error& error) {
    reason = error.what();
  }
  log::debug("{}", reason);
  return false;
}

void runFrame(const ConvertArguments& options, std::int64_t frame) {
  std::vector<std::string> inputs;
  for (const std::string& path : options.inputs)
    inputs.push_back(framePath(path, frame));
  const std::string output = framePath(options.output, frame);
  if (options.frames.skipExisting && isComplete(output)) {
    printLine("{}: exists and is complete, skipped", output);
    return;
  }
  if (options.frames.dryRun) {
    printLine("{} -> {}", fmt::join(inputs, " + "), output);
    return;
  }
  checkFormatOptions(options.convert, inputs, output);
  checkWritable(output);
  convertFrame(inputs, output, options.convert);
}

int runConvert(ConvertArguments& options) {
  options.convert.placement.origin = parseVec3("--origin", options.origin);
  for (const std::string& text : options.formatOptions)
    options.convert.formatOptions.push_back(parseAssignment("--format-option", text));
  caches::formatForWriting(options.output);
  const std::vector<std::int64_t> frames = chooseFrames(options);
  checkOutputPattern(options.output, frames.size());
  JobFiles files;
  for (const std::string& path : options.inputs)
    files.reads("IN", path, frames);
  files.writes("-o", options.output, frames);
  return runFrames(fmt::format("{}", fmt::join(options.inputs, " + ")), frames,
                   options.frames.keepGoing, [&](std::int64_t frame) { runFrame(options, frame); });
}

std::function<int()> declareConvert(CLI::App& app) {
  auto options = std::make_shared<ConvertArguments>();
  ConvertOptions& convert = options->convert;
  app.add_option("IN", options->inputs,
                 "Files of one frame, or patterns such as smoke.####.vdb; several are put together")
      ->type_name("FILE")
      ->required();
  app.add_option("-o,--output", options->output,
                 "File to write (.vdb .ply .csv .prt), with #### "
                 "for a sequence")
      ->type_name("OUT")
      ->required();
  app.add_option("--origin", options->origin,
                 "World position of the domain's corner, which Blender's caches leave out: added "
                 "to .vdb and .uni content [0,0,0]")
      ->type_name("X,Y,Z");
  app.add_flag("--cell-centered", convert.placement.cellCentered,
               "Grid values belong to cell centres (Blender): add half a voxel");
  app.add_option("--velocity-scale", convert.placement.velocityScale,
                 "Factor on velocity grids, to scene units per second [1]")
      ->check(finiteNumber())
      ->type_name("F");
  app.add_option("--density", convert.density, "Grid that is the medium [density]")
      ->type_name("NAME");
  app.add_option("--radius", convert.radius,
                 "Particle radius in scene units; 0 = pscale, else twice the median spacing [0]")
      ->check(finiteNumber({.least = 0}))
      ->type_name("R");
  app.add_flag("--keep-strays", convert.keepStrays,
               "Rasterize the few particles that lie far from all others, too");
  app.add_option("--voxel-size", convert.voxelSize,
                 "Voxel of the rasterized density in scene units; 0 = half the median radius [0]")
      ->check(finiteNumber({.least = 0}))
      ->type_name("H");
  app.add_option("--particles", convert.particles,
                 "Particles seeded where the input has grids only; 0 = none [60000]")
      ->check(countingNumber())
      ->type_name("N");
  app.add_option("--seed", convert.seed, "Seed of the seeded particles [1]")
      ->check(countingNumber())
      ->type_name("N");
  app.add_flag(
      "--allow-invalid", convert.allowInvalid,
      "Write NaN, infinite and, in the density, negative values of grids as zero [exit 4]");
  app.add_option("--format-option", options->formatOptions, "Option of a format, listed below")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  addFrameOptions(app, options->frames);
  app.footer([] { return formatHelp(); });
  return [options] { return runConvert(*options); };
}

}  // namespace

extern const Command convert;
const Command convert = {"convert", "Turn simulation caches into VDB points and grids, and back",
                         declareConvert};

}  // namespace photosphere::cli::plugins
