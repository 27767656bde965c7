// photosphere study: error against time over estimators and settings.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "command.h"
#include "frame_loop.h"
#include "job_files.h"
#include "number_check.h"
#include "options.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/log.h"
#include "photosphere/core/parallel.h"
#include "photosphere/study/paper.h"
#include "photosphere/study/stability.h"
#include "photosphere/study/study.h"
#include "print.h"

namespace photosphere::cli::plugins {

namespace {

struct StudyArguments {
  study::StudyOptions study;
  std::string scene, output, cache, resolution, frames;
  bool noHardCases = false, noFlicker = false, paper = false, hard = false;
  std::vector<std::string> cases;
};

// What to work on is said once.
void checkSubject(const StudyArguments& options) {
  const bool own = options.paper || options.hard;
  if (options.paper && options.hard) throw ConfigError("give --paper or --hard, not both");
  if (own != options.scene.empty())
    throw ConfigError(own ? fmt::format("{} has scenes of its own; leave SCENE out",
                                        options.paper ? "--paper" : "--hard")
                          : "SCENE is required; or give --paper for the paper's exhibits, --hard "
                            "for the table of hard cases");
  if (!options.hard && !options.cases.empty()) throw ConfigError("--case goes with --hard alone");
  if (!options.hard && options.output.empty()) throw ConfigError("-o DIR is required");
}

void complete(StudyArguments& options) {
  checkSubject(options);
  study::StudyOptions& s = options.study;
  s.scene = options.scene;
  s.output = options.output;
  s.cache = options.cache;
  s.hardCases = !options.noHardCases;
  s.flicker = !options.noFlicker;
  s.threads = availableThreads();
  for (const std::string& text : s.sets)
    parseAssignment("--set", text);
  if (!options.frames.empty()) s.frames = parseFrames(options.frames);
  if (options.resolution.empty()) return;
  const auto size = parseInts("--res", options.resolution, 'x', 2, "WxH, such as 256x144");
  if (std::max(size[0], size[1]) > study::kLargestEdge)
    throw ConfigError(fmt::format("--res {}: a study's frames have at most {} pixels an edge",
                                  options.resolution, study::kLargestEdge));
  s.sets.push_back(fmt::format("camera.resolution=[{}, {}]", size[0], size[1]));
}

// Before the work, not after it.
void checkReport(const study::StudyOptions& s, std::initializer_list<const char*> names) {
  JobFiles files;
  files.reads("SCENE", s.scene.string());
  files.reads("--ocio", s.ocioConfig);
  for (const char* name : names) {
    const std::string path = (s.output / name).string();
    files.writes("the report's file", path);
    checkWritable(path);
  }
}

int reportPaper(const study::StudyOptions& s) {
  checkReport(s, {"paper.csv", "paper.json", "index.html"});
  const study::PaperResult result = study::runPaper(s);
  study::writePaperReport(result, s);
  printLine("{}: {} exhibits, {:.1f} s", (s.output / "index.html").string(), result.exhibits.size(),
            result.elapsedSeconds);
  return static_cast<int>(ExitCode::ok);
}

int reportSweeps(const study::StudyOptions& s) {
  study::gnuplotVersion();
  checkReport(s, {"study.csv", "study.json", "index.html"});
  const study::StudyResult result = study::runStudy(s);
  study::writeReport(result, s);
  std::size_t points = 0;
  for (const study::SweepResult& sweep : result.sweeps)
    points += sweep.points.size();
  printLine("{}: {} points in {} sweeps, {:.1f} s", (s.output / "index.html").string(), points,
            result.sweeps.size(), result.elapsedSeconds);
  return static_cast<int>(ExitCode::ok);
}

// The table goes to standard output, with -o as CSV too. Any row outside its bound is exit 7.
int reportHardCases(const StudyArguments& options) {
  for (const bool unused : {!options.study.sets.empty(), !options.resolution.empty(),
                            !options.frames.empty(), options.study.minutes > 0})
    if (unused)
      throw ConfigError(
          "--hard runs its catalogue as it is: --set, --res, --frames and --minutes do not go with "
          "it");
  checkWritable(options.output);
  study::StabilityOptions hard;
  hard.quick = options.study.quick;
  hard.cases = options.cases;
  hard.estimators = options.study.families;
  printLine("{}", study::stabilityHead());
  const std::vector<study::StabilityRow> rows = study::runStability(
      hard, [](const study::StabilityRow& row) { printLine("{}", study::stabilityLine(row)); });
  const auto failed = std::count_if(rows.begin(), rows.end(),
                                    [](const study::StabilityRow& row) { return !row.passed; });
  if (!options.output.empty()) study::writeStabilityCsv(options.output, rows);
  for (const std::string& line : study::stabilityDigest(rows))
    printLine("{}", line);
  printLine("{} rows, {} outside their bounds", rows.size(), failed);
  return static_cast<int>(failed > 0 ? ExitCode::accuracy : ExitCode::ok);
}

int runStudy(StudyArguments& options) {
  complete(options);
  if (options.hard) return reportHardCases(options);
  try {
    return options.paper ? reportPaper(options.study) : reportSweeps(options.study);
  } catch (const InterruptedError& stopped) {
    log::error("{}; references so far are kept: run the same command again to go on",
               stopped.what());
    return static_cast<int>(ExitCode::interruptedResumable);
  }
}

void declareSettings(CLI::App& app, StudyArguments& options) {
  study::StudyOptions& s = options.study;
  app.add_option("-s,--set", s.sets, "Override a key of the scene; repeatable")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--res", options.resolution,
                 "Frame size, at most 256 an edge [the scene's, scaled]")
      ->type_name("WxH");
  app.add_option("--frames", options.frames,
                 "The last is studied, flicker is measured over all [scene.frames]")
      ->type_name("RANGE");
  app.add_option("--minutes", s.minutes,
                 "Time to spend, about; what does not fit is left out [10, quick 0.1]")
      ->check(finiteNumber({.positive = true}))
      ->type_name("N");
  app.add_option("--seeds", s.seeds, "Independent frames of each contender, at least 3 [5]")
      ->check(CLI::Range(3, 1000).description(""))
      ->type_name("N");
  app.add_option("--family", s.families, "Only these contenders; repeatable [all]")
      ->type_name("NAME")
      ->allow_extra_args(false);
  app.add_option("--cache", options.cache,
                 "Folder of references, reused by later studies [DIR/cache]")
      ->type_name("DIR");
  app.add_flag("--no-hard-cases", options.noHardCases,
               "Leave out the scenes that are hard for the photosphere");
  app.add_flag("--no-flicker", options.noFlicker, "Leave out frame-to-frame error");
  app.add_flag("--bases", s.bases,
               "Also compare the bases of directions, for phases of g from -0.5 to 0.95");
  app.add_flag("--quick", s.quick, "Tiny frames and little work, to try the command");
}

std::function<int()> declareStudy(CLI::App& app) {
  auto options = std::make_shared<StudyArguments>();
  app.add_option("SCENE", options->scene, "Scene (.toml), or a cache for which one is made up")
      ->type_name("FILE");
  app.add_flag("--paper", options->paper,
               "The exhibits of Min & Ihm 2010 on the shipped smoke, in place of a scene");
  app.add_flag("--hard", options->hard,
               "The table of hard cases: what is numerically hard, the known answer, the result; "
               "exit 7 when a row is outside its bound");
  app.add_option("--case", options->cases,
                 "With --hard: only cases whose names begin so; repeatable [all]")
      ->type_name("NAME")
      ->allow_extra_args(false);
  app.add_option("-o,--output", options->output,
                 "Folder of index.html, study.csv and study.json; with --hard, the table as CSV")
      ->type_name("DIR");
  declareSettings(app, *options);
  study::StudyOptions& s = options->study;
  const char* group = "Pictures";
  app.add_option("--ocio", s.ocioConfig, "OpenColorIO config [$OCIO, else the one shipped]")
      ->type_name("FILE")
      ->group(group);
  app.add_option("--ocio-display", s.ocioDisplay, "Display of the pictures")
      ->type_name("NAME")
      ->group(group);
  app.add_option("--ocio-view", s.ocioView, "View of the pictures")
      ->type_name("NAME")
      ->group(group);
  return [options] { return runStudy(*options); };
}

}  // namespace

extern const Command study;
const Command study = {"study", "Measure error against time over estimators and settings",
                       declareStudy};

}  // namespace photosphere::cli::plugins
