#include "plugin_text.h"

#include <fmt/format.h>

#include <array>
#include <span>
#include <string_view>

#include "photosphere/caches/cache_format.h"
#include "photosphere/cameras/camera.h"
#include "photosphere/core/param.h"
#include "photosphere/lights/light.h"
#include "photosphere/phase/phase.h"
#include "photosphere/scene/scene_file.h"

namespace photosphere::cli {

namespace {

constexpr int kIndent = 6;

template <class Plugin>
std::string describeTable(std::span<const Plugin* const> table) {
  std::string text;
  for (const Plugin* plugin : table)
    text += fmt::format("  {}: {}\n{}", plugin->name, plugin->help,
                        formatParams(plugin->params, kIndent));
  return text;
}

std::string describeRows(std::string_view title, std::span<const Param> rows) {
  return fmt::format("  {}\n{}", title, formatParams(rows, kIndent));
}

}  // namespace

std::string describeFormats() {
  std::string text;
  for (const caches::CacheFormat* format : caches::cacheFormats())
    text += fmt::format("  {}: {} ({}; {})\n{}", format->name, format->help,
                        fmt::join(format->extensions, " "),
                        !format->write  ? "read"
                        : !format->read ? "written"
                                        : "read and written",
                        formatParams(format->params, kIndent));
  return text;
}

std::string describePhases() {
  return describeTable(phase::phaseFunctions());
}

std::string describeLights() {
  return describeRows("every light", lights::lightParams()) + describeTable(lights::lightModels());
}

std::string describeCameras() {
  return describeRows("every camera", cameras::cameraParams()) +
         describeTable(cameras::cameraModels());
}

std::string describeEstimators() {
  // The types and their options are one table of rows: `type` names those that there are.
  std::string text = describeRows("[estimator]", scene::estimatorParams());
  for (const scene::Preset& preset : scene::estimatorPresets()) {
    text += fmt::format("  preset = \"{}\": {}\n", preset.name, preset.help);
    for (const scene::PresetValue& value : preset.values)
      text += fmt::format("{:{}}{} = {}\n", "", kIndent, value.key, value.value);
  }
  return text;
}

std::string describeScene() {
  return describeRows("[scene]", scene::sceneParams()) +
         describeRows("[[volume]]", scene::volumeParams()) +
         describeRows("emission of a [[volume]]", scene::emissionParams()) +
         describeRows("[effects]", scene::effectsParams()) +
         describeRows("[render]", scene::renderParams()) +
         describeRows("[output]", scene::outputParams());
}

}  // namespace photosphere::cli
