// photosphere plan: which effects a scene calls for, and what they cost.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "command.h"
#include "frame_loop.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"
#include "photosphere/scene/plan.h"
#include "print.h"
#include "scene_options.h"

namespace photosphere::cli::plugins {

namespace {

struct PlanArguments {
  SceneOptions scene;
  bool json = false;
};

void printText(const scene::FramePlan& plan) {
  printLine("frame {}: {} x {} pixels, estimator {}, smoke {}", plan.frame, plan.resolution.x,
            plan.resolution.y, plan.estimator, formatBox(plan.smoke));
  printLine("  {:<20} {:<4} {:<8} {}", "effect", "", "bound", "why");
  printEffects(plan.effects);
  if (!plan.layout.empty()) printLine("  {:<20} {}", "light field", plan.layout);
  const scene::StageSeconds& s = plan.seconds;
  printLine(
      "  {:<20} {:.2f}: read {:.2f}, rasterize {:.2f}, trace {:.2f}, resolve {:.2f}, march {:.2f}",
      "predicted seconds", s.total, s.read, s.rasterize, s.trace, s.resolve, s.march);
  const scene::FrameMemory& m = plan.memory;
  printLine("  {:<20} {}: smoke {}, light {}, shadows {}, pixels {}{}", "predicted memory",
            formatBytes(m.total()), formatBytes(m.smoke), formatBytes(m.light),
            formatBytes(m.shadows), formatBytes(m.pixels),
            plan.memoryBudget > 0 ? fmt::format(" of {}", formatBytes(plan.memoryBudget)) : "");
  for (const std::string& note : plan.notes)
    log::info("frame {}: {}", plan.frame, note);
}

int runPlan(const PlanArguments& options) {
  const scene::SceneFile scene = openScene(options.scene);
  if (options.scene.dumpScene) {
    printLine("{}", scene::dumpScene(scene));
    return static_cast<int>(ExitCode::ok);
  }
  const std::vector<std::int64_t> frames = sceneFrameList(scene, options.scene);
  const CacheFrames cacheFrames(scene, options.scene);
  scene::SceneFile empty = scene;
  empty.volumes.clear();
  std::vector<std::string> objects;
  const int code = runFrames(
      options.scene.scene, frames, options.scene.frames.keepGoing, [&](std::int64_t frame) {
        scene::RenderRequest request;
        request.allowStale = options.scene.allowStale;
        std::int64_t cacheFrame = frame;
        const bool smoke = cacheFrames.map(frame, cacheFrame);
        if (cacheFrame != frame) request.cacheFrame = cacheFrame;
        const scene::FramePlan plan = scene::planScene(smoke ? scene : empty, frame, request);
        if (options.json)
          objects.push_back(scene::planJson(plan));
        else
          printText(plan);
      });
  if (options.json && objects.size() == 1)
    printLine("{}", objects.front());
  else if (options.json)
    printLine("[{}]", fmt::join(objects, ",\n"));
  return code;
}

std::function<int()> declarePlan(CLI::App& app) {
  auto options = std::make_shared<PlanArguments>();
  app.add_flag("--json", options->json, "One JSON object a frame, or an array of them");
  addPlanOptions(app, options->scene);
  app.footer(
      "An effect is off where the scene says so, where it adds exactly nothing (bound 0), or "
      "where\n"
      "what it adds to any pixel is bounded below effects.tolerance times the mean radiance of "
      "the\n"
      "pixels that show smoke. All bounds together stay below that. Seconds are predicted for "
      "this\n"
      "machine, from short pieces of the work.");
  return [options] { return runPlan(*options); };
}

}  // namespace

extern const Command plan;
const Command plan = {
    "plan", "Say which effects a scene, or a cache, calls for and why, and what a frame costs",
    declarePlan};

}  // namespace photosphere::cli::plugins
