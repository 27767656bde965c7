#include "scene_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>

#include "frame_loop.h"
#include "number_check.h"
#include "photosphere/core/error.h"
#include "photosphere/core/hash.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"
#include "photosphere/core/version.h"
#include "print.h"

namespace photosphere::cli {

namespace {

// Among the files of a job.
constexpr const char* kSceneRole = "the scene";

struct NamedHold {
  std::string_view name;
  CacheHold hold;
};
constexpr std::array kHolds = {
    NamedHold{"clip", CacheHold::clip}, NamedHold{"extend", CacheHold::extend},
    NamedHold{"repeat", CacheHold::repeat}, NamedHold{"pingpong", CacheHold::pingpong}};

void addScenePaths(CLI::App& app, SceneOptions& options) {
  app.add_option("SCENE", options.scene, "Scene (.toml), or a cache for which one is made up")
      ->type_name("FILE")
      ->required();
  app.add_option("-s,--set", options.sets,
                 "Override a key of the scene, such as volume.0.density_scale=4; repeatable")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--seed", options.seed, "Replaces scene.seed")
      ->type_name("N")
      ->check(wholeNumber());
  app.add_option("--res", options.resolution, "Replaces camera.resolution")->type_name("WxH");
  app.add_option("--colorspace", options.colorspace, "Replaces output.colorspace")
      ->type_name("NAME");
  app.add_flag("--dump-scene", options.dumpScene,
               "Print the scene as TOML with every key, and do nothing");
}

/// The first volume whose file is numbered; empty when there is none.
std::string numberedCache(const scene::SceneFile& scene) {
  for (const scene::VolumeEntry& volume : scene.volumes) {
    std::string path = scene.resolvePath(volume.values.text("file"));
    if (hasFrameToken(path)) return path;
  }
  return {};
}

}  // namespace

void addSceneOptions(CLI::App& app, SceneOptions& options) {
  addPlanOptions(app, options);
  app.add_option("--stats", options.stats,
                 "Statistics as JSON: an object a frame with #### in the path, else an array when "
                 "there are several frames")
      ->type_name("FILE.json");
  addOutputFrameOptions(app, options.frames);
  addResumeOptions(app, options.resume);
}

void addPlanOptions(CLI::App& app, SceneOptions& options) {
  addScenePaths(app, options);
  app.add_flag("--allow-stale", options.allowStale,
               "Use a light cache that was made for another medium or other lights");
  app.add_flag("--allow-invalid", options.allowInvalid,
               "Treat NaN, infinite and negative values of caches and of pictures that light the "
               "scene as zero [exit 4]");
  app.add_option("--cache-offset", options.cacheOffset,
                 "Frame of the caches minus frame of the picture [0]")
      ->check(frameNumber())
      ->type_name("N")
      ->group("Frames");
  std::vector<std::string> names;
  for (const NamedHold& hold : kHolds)
    names.emplace_back(hold.name);
  app.add_option("--cache-hold", options.cacheHold,
                 "Outside the caches' frames: clip (no smoke), extend, repeat, pingpong [an error]")
      ->type_name("HOW")
      ->check(CLI::IsMember(names).description(""))
      ->group("Frames");
  addFrameRange(app, options.frames);
}

scene::SceneFile openScene(const SceneOptions& options) {
  std::vector<std::string> sets = options.sets;
  for (const std::string& text : sets)
    parseAssignment("--set", text);
  // After -s: the option that is more explicit wins.
  if (!options.resolution.empty()) {
    const auto size = parseInts("--res", options.resolution, 'x', 2, "WxH, such as 1280x720");
    sets.push_back(fmt::format("camera.resolution=[{}, {}]", size[0], size[1]));
  }
  if (options.seed) sets.push_back(fmt::format("scene.seed={}", *options.seed));
  const std::filesystem::path path(options.scene);
  scene::SceneFile scene = path.extension() == ".toml"
                               ? scene::loadScene(path, sets)
                               : scene::sceneForVolume(path, sets, options.allowInvalid);
  scene.allowInvalid = options.allowInvalid;
  if (!options.colorspace.empty())
    scene.output.set("colorspace", options.colorspace, "--colorspace");
  for (const std::string& choice : scene.choices)
    log::info("{}", choice);
  return scene;
}

std::vector<std::int64_t> sceneFrameList(const scene::SceneFile& scene,
                                         const SceneOptions& options) {
  if (!options.frames.frames.empty()) return parseFrames(options.frames.frames);
  if (!scene.scene.text("frames").empty()) return scene::sceneFrames(scene);
  const std::string pattern = numberedCache(scene);
  if (pattern.empty()) return {1};
  std::vector<std::int64_t> frames = framesByFiles(pattern);
  for (std::int64_t& frame : frames)
    frame -= options.cacheOffset;
  return frames;
}

CacheFrames::CacheFrames(const scene::SceneFile& scene, const SceneOptions& options)
    : m_offset(options.cacheOffset) {
  for (const NamedHold& known : kHolds)
    if (known.name == options.cacheHold) m_hold = known.hold;
  if (!m_hold) return;
  const std::string pattern = numberedCache(scene);
  if (pattern.empty()) {
    m_hold.reset();  // one file for all frames: there is no outside
    return;
  }
  const auto frames = existingFrames(pattern);
  m_first = frames.front();
  m_last = frames.back();
}

bool CacheFrames::map(std::int64_t frame, std::int64_t& cacheFrame) const {
  cacheFrame = frame + m_offset;
  return !m_hold || mapFrame(cacheFrame, m_first, m_last, *m_hold, cacheFrame);
}

JobFiles filesRead(const scene::SceneFile& scene, const std::vector<std::int64_t>& frames,
                   const CacheFrames& cacheFrames) {
  std::vector<std::int64_t> ofCaches;
  std::int64_t cacheFrame = 0;
  for (const std::int64_t frame : frames)
    if (cacheFrames.map(frame, cacheFrame)) ofCaches.push_back(cacheFrame);
  JobFiles files;
  files.reads(kSceneRole, scene.path);
  for (std::size_t i = 0; i < scene.volumes.size(); ++i)
    files.reads(fmt::format("volume.{}.file", i),
                scene.resolvePath(scene.volumes[i].values.text("file")), ofCaches);
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    const ParamValues& light = scene.lights[i].values;
    if (light.given("file"))
      files.reads(fmt::format("light.{}.file", i), scene.resolvePath(light.text("file")));
  }
  files.reads("camera.file", scene.resolvePath(scene.camera.text("file")));
  files.reads("estimator.cache", scene.resolvePath(scene.estimator.text("cache")), frames);
  return files;
}

ResumableJob resumableJob(const scene::SceneFile& scene, const SceneOptions& options,
                          const std::string& more, const std::vector<std::int64_t>& frames,
                          const CacheFrames& cacheFrames, const std::vector<std::string>& outputs) {
  // All that the scene says, of the output as well.
  Hasher job;
  job.text(scene::dumpScene(scene));
  job.text(fmt::format("{} {} {} {} {}", options.cacheOffset, options.cacheHold, options.allowStale,
                       options.stats, more));
  return {options.resume, fmt::format("{} {}", buildText(), job.hex()), frames,
          [outputs](std::int64_t frame) { return framePath(outputs.front(), frame); },
          // A scene that was written anew says the same: that counts, and not its file.
          [&scene, cacheFrames](std::int64_t frame) {
            return filesRead(scene, {frame}, cacheFrames).stamp(kSceneRole);
          },
          [outputs](std::int64_t frame) {
            JobFiles made;
            for (const std::string& output : outputs)
              made.reads("output", output, {frame});
            return made.stamp("");
          }};
}

void printPlan(const scene::SceneFile& scene, std::int64_t frame,
               const scene::RenderRequest& request, bool forLightCache) {
  scene::SetupOptions options;
  options.cacheFrame = request.cacheFrame;
  options.forLightCache = forLightCache;
  const scene::FrameSetup setup = scene::setUpFrame(scene, frame, options);
  const std::string type = scene.estimator.text("type");
  printLine("frame {}: {} x {} pixels, estimator {}, smoke {}", frame, setup.camera->resolution().x,
            setup.camera->resolution().y, type, formatBox(setup.worldBounds));
  printEffects(setup.effectStates);
  const bool storesLight = scene::storesLight(scene, setup);
  if (storesLight)
    printLine("  {:<20} {}", setup.photonMap ? "photon map" : "light field",
              formatBytes(scene::predictedLightBytes(setup)));
  if (setup.memoryBudget > 0)
    printLine("  memory budget        {}", formatBytes(setup.memoryBudget));
  for (const std::string& note : setup.notes)
    log::info("{}", note);
  scene::checkMemory(setup, storesLight);
}

void printEffects(const std::vector<scene::EffectState>& effects) {
  for (const scene::EffectState& effect : effects)
    printLine("  {:<20} {:<4} {:<8} {}", effect.name, effect.on ? "on" : "off",
              effect.bound ? fmt::format("{:.2g}", *effect.bound) : "-", effect.why);
}

void printDryRun(std::int64_t frame, const std::string& output, std::int64_t cacheFrame,
                 bool smoke) {
  std::string source;
  if (!smoke)
    source = " without smoke: outside the caches' frames";
  else if (cacheFrame != frame)
    source = fmt::format(" from frame {} of the caches", cacheFrame);
  printLine("frame {}: {}{}", frame, output, source);
}

std::string formatSeconds(const scene::StageSeconds& seconds) {
  return fmt::format(
      "read {:.2f}, rasterize {:.2f}, trace {:.2f}, resolve {:.2f}, march {:.2f}, {}write {:.2f}, "
      "total {:.2f} s",
      seconds.read, seconds.rasterize, seconds.trace, seconds.resolve, seconds.march,
      seconds.check > 0 ? fmt::format("check {:.2f}, ", seconds.check) : "", seconds.write,
      seconds.total);
}

}  // namespace photosphere::cli
