#include "scene_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "estimator_options.h"
#include "photosphere/cameras/camera.h"
#include "photosphere/cameras/chan.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/registry.h"
#include "photosphere/lights/light.h"
#include "photosphere/phase/phase.h"

namespace photosphere::scene {

namespace {

// "24000/1001" as a number; plain numbers as they are.
ParamValue frameRate(ParamValue value, const std::string& place) {
  const auto* text = std::get_if<std::string>(&value);
  if (!text) return value;
  double numerator = 0, denominator = 0;
  int used = 0;
  if (std::sscanf(text->c_str(), "%lf/%lf%n", &numerator, &denominator, &used) == 2 &&
      used == static_cast<int>(text->size()) && denominator > 0)
    return numerator / denominator;
  throw ConfigError(fmt::format(
      "{}: 'fps' = '{}' is neither a number nor a ratio such as \"24000/1001\"", place, *text));
}

// A key that belongs to another plug-in of the kind deserves a better message than "unknown".
template <class Plugin>
void explainForeignKey(std::span<const Plugin* const> plugins, std::string_view key,
                       std::string_view kind, std::string_view type, const std::string& place) {
  std::vector<std::string_view> owners;
  for (const Plugin* plugin : plugins)
    for (const Param& row : plugin->params)
      if (row.name == key) owners.push_back(plugin->name);
  if (!owners.empty())
    throw ConfigError(fmt::format("{}: '{}' is an option of {} {}, not of {}", place, key, kind,
                                  fmt::join(owners, ", "), type));
}

}  // namespace

std::vector<Param> joinRows(std::span<const Param> common, std::span<const Param> own) {
  std::vector<Param> rows(common.begin(), common.end());
  rows.insert(rows.end(), own.begin(), own.end());
  return rows;
}

const toml::table* SceneReader::table(const std::string& name) const {
  const toml::node* node = m_text.root.get(name);
  if (!node) return nullptr;
  if (!node->is_table())
    throw ConfigError(fmt::format("{}: must be a table, `[{}]`", where(*node, name, name), name));
  return node->as_table();
}

const toml::array* SceneReader::tables(const std::string& name) const {
  const toml::node* node = m_text.root.get(name);
  if (!node) return nullptr;
  const auto refuse = [&](const toml::node& wrong, const std::string& dotted) {
    throw ConfigError(fmt::format("{}: every {} begins with `[[{}]]`, in double brackets",
                                  where(wrong, dotted, name), name, name));
  };
  const toml::array* array = node->as_array();
  if (!array) refuse(*node, name);
  for (std::size_t i = 0; i < array->size(); ++i)
    if (!array->get(i)->is_table()) refuse(*array->get(i), fmt::format("{}.{}", name, i));
  return array;
}

void SceneReader::readPlain(const std::string& name, ParamValues& values) const {
  const toml::table* from = table(name);
  if (!from) return;
  for (const auto& [key, node] : *from) {
    const std::string k(key.str());
    const std::string place = where(node, name + "." + k, name);
    values.set(k, hasRow(values, k) ? valueOf(node, k, place) : ParamValue(), place);
  }
}

void SceneReader::readScene() {
  const toml::table* from = table("scene");
  if (!from) return;
  for (const auto& [key, node] : *from) {
    const std::string k(key.str());
    const std::string place = where(node, "scene." + k, "scene");
    ParamValue value = hasRow(m_scene.scene, k) ? valueOf(node, k, place) : ParamValue();
    if (k == "fps") value = frameRate(value, place);
    // A single frame may be written as a number.
    if (const auto* one = std::get_if<std::int64_t>(&value); k == "frames" && one)
      value = std::to_string(*one);
    m_scene.scene.set(k, value, place);
    if (k == "frames" && !m_scene.scene.text(k).empty()) {
      try {
        parseFrames(m_scene.scene.text(k));
      } catch (const ConfigError& error) {
        throw ConfigError(fmt::format("{}: {}", place, error.what()));
      }
    }
  }
}

void SceneReader::readCamera() {
  const toml::table* from = table("camera");
  const toml::node* type = from ? from->get("type") : nullptr;
  const std::string place =
      from ? where(*from, "camera", "camera") : fmt::format("{}: [camera]", m_text.name);
  m_scene.cameraWhere = place;
  if (type) m_scene.cameraType = textOf(*type, "type", where(*type, "camera.type", "camera"));
  const cameras::CameraPlugin& plugin =
      findPlugin(cameras::cameraModels(), m_scene.cameraType, "camera type",
                 type ? where(*type, "camera.type", "camera") : place);
  m_scene.camera = ParamValues(joinRows(cameras::cameraParams(), plugin.params));
  if (!from) return;
  for (const auto& [key, node] : *from) {
    const std::string k(key.str());
    if (k == "type") continue;
    const std::string at = where(node, "camera." + k, "camera");
    if (!hasRow(m_scene.camera, k))
      explainForeignKey(cameras::cameraModels(), k, "camera type", m_scene.cameraType, at);
    readAnimated("camera", k, node, m_scene.camera, m_scene.cameraKeys);
    if (k == "resolution" && m_scene.camera.vec2(k) != glm::floor(m_scene.camera.vec2(k)))
      throw ConfigError(fmt::format("{}: 'resolution' must be two whole numbers", at));
  }
  readShot();
}

void SceneReader::readShot() {
  const std::string& file = m_scene.camera.text("file");
  if (file.empty()) return;
  const auto refuse = [&](std::string_view key) {
    if (hasRow(m_scene.camera, key) && m_scene.camera.given(key))
      throw ConfigError(fmt::format("{}: 'file' says what '{}' does; remove one of them",
                                    m_scene.cameraWhere, key));
  };
  for (const std::string_view key : {"position", "look_at", "up", "matrix"})
    refuse(key);
  for (const cameras::ChanKey& line : cameras::readChan(m_scene.resolvePath(file))) {
    std::vector<double> rows;
    for (int i = 0; i < 16; ++i)
      rows.push_back(line.worldFromCamera[i % 4][i / 4]);
    m_scene.shot["matrix"].push_back({line.frame, rows});
    if (line.verticalFov > 0)
      m_scene.shot[std::string(kShotFov)].push_back({line.frame, {line.verticalFov}});
  }
  if (m_scene.shot.contains(kShotFov))
    for (const std::string_view key : {"fov", "focal_length", "horizontal_aperture"})
      refuse(key);
}

void SceneReader::readAlbedo(const toml::node& node, const std::string& path,
                             VolumeEntry& entry) const {
  const std::string place = where(node, path + ".albedo", path);
  if (!node.is_string()) {
    readAnimated(path, "albedo", node, entry.values, entry.keys);
    return;
  }
  entry.albedoGrid = textOf(node, "albedo", place);
  if (entry.albedoGrid.empty())
    throw ConfigError(
        fmt::format("{}: 'albedo' must be a number, [r, g, b] or the name of a grid", place));
}

void SceneReader::readPhase(const toml::node& node, const std::string& path,
                            VolumeEntry& entry) const {
  const std::string place = where(node, path, path);
  const toml::table* from = node.as_table();
  if (!from)
    throw ConfigError(fmt::format(
        "{}: 'phase' must be a table such as {{ type = \"henyey_greenstein\", g = 0.4 }}", place));
  if (const toml::node* type = from->get("type"))
    entry.phase = textOf(*type, "type", where(*type, path + ".type", path));
  const phase::PhasePlugin& plugin =
      findPlugin(phase::phaseFunctions(), entry.phase, "phase function", place);
  entry.phaseValues = ParamValues(plugin.params);
  for (const auto& [key, value] : *from) {
    const std::string k(key.str());
    if (k == "type") continue;
    const std::string at = where(value, path + "." + k, path);
    if (!hasRow(entry.phaseValues, k))
      explainForeignKey(phase::phaseFunctions(), k, "phase function", entry.phase, at);
    readAnimated(path, k, value, entry.phaseValues, entry.phaseKeys);
  }
  try {
    plugin.create(entry.phaseValues);
    for (const auto& [name, track] : entry.phaseKeys)
      for (const Key& key : track) {
        ParamValues then = entry.phaseValues;
        setToTime(entry.phaseKeys, key.frame, then, place);
        plugin.create(then);
      }
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}: {}", place, error.what()));
  }
}

void SceneReader::readEmission(const toml::node& node, const std::string& path,
                               VolumeEntry& entry) const {
  const std::string place = where(node, path, path);
  const toml::table* from = node.as_table();
  if (!from)
    throw ConfigError(fmt::format(
        "{}: 'emission' must be a table such as {{ grid = \"flame\", scale = 20.0 }}", place));
  entry.emits = true;
  for (const auto& [key, value] : *from) {
    const std::string k(key.str());
    readAnimated(path, k, value, entry.emission, entry.emissionKeys);
  }
  const bool thermal = !entry.emission.text("temperature").empty();
  if (thermal == !entry.emission.text("grid").empty())
    throw ConfigError(fmt::format(
        "{}: 'emission' needs either 'grid' or 'temperature', the name of a grid", place));
  for (const std::string_view key : {"color", "kelvin_scale", "kelvin_offset"})
    if (entry.emission.given(key) && thermal == (key == "color"))
      throw ConfigError(fmt::format("{}: '{}' does not go with '{}'", place, key,
                                    thermal ? "temperature" : "grid"));
}

void SceneReader::readVolume(const toml::table& from, std::size_t index) {
  const std::string path = fmt::format("volume.{}", index);
  VolumeEntry entry;
  entry.where = where(from, path, path);
  entry.values = ParamValues(volumeParams());
  entry.emission = ParamValues(emissionParams());
  entry.phaseValues =
      ParamValues(findPlugin(phase::phaseFunctions(), entry.phase, "phase", entry.where).params);
  for (const auto& [key, node] : from) {
    const std::string k(key.str());
    const std::string place = where(node, path + "." + k, path);
    if (k == "phase") {
      readPhase(node, path + ".phase", entry);
    } else if (k == "albedo") {
      readAlbedo(node, path, entry);
    } else if (k == "emission") {
      readEmission(node, path + ".emission", entry);
    } else {
      readAnimated(path, k, node, entry.values, entry.keys);
    }
  }
  if (entry.values.text("file").empty())
    throw ConfigError(
        fmt::format("{}: 'file' is missing: every volume names its cache", entry.where));
  m_scene.volumes.push_back(std::move(entry));
}

void SceneReader::readLight(const toml::table& from, std::size_t index) {
  const std::string path = fmt::format("light.{}", index);
  LightEntry entry;
  entry.where = where(from, path, path);
  const toml::node* type = from.get("type");
  if (!type)
    throw ConfigError(fmt::format("{}: 'type' is missing (known: {})", entry.where,
                                  fmt::join(pluginNames(lights::lightModels()), ", ")));
  const std::string typePlace = where(*type, path + ".type", path);
  entry.type = textOf(*type, "type", typePlace);
  const lights::LightPlugin& plugin =
      findPlugin(lights::lightModels(), entry.type, "light type", typePlace);
  entry.values = ParamValues(joinRows(lights::lightParams(), plugin.params));
  for (const auto& [key, node] : from) {
    const std::string k(key.str());
    if (k == "type") continue;
    const std::string place = where(node, path + "." + k, path);
    if (!hasRow(entry.values, k))
      explainForeignKey(lights::lightModels(), k, "light type", entry.type, place);
    readAnimated(path, k, node, entry.values, entry.keys);
  }
  m_scene.lights.push_back(std::move(entry));
}

void SceneReader::read() {
  constexpr std::string_view known[] = {"scene",     "camera",  "volume", "light",
                                        "estimator", "effects", "render", "output"};
  for (const auto& [key, node] : m_text.root) {
    const std::string k(key.str());
    if (std::find(std::begin(known), std::end(known), k) == std::end(known))
      throw ConfigError(fmt::format("{}: unknown {} '{}'{} (known: {})", where(node, k, k),
                                    node.is_table() ? "table" : "key", k, suggestion(k, known),
                                    fmt::join(known, ", ")));
  }
  m_scene.scene = ParamValues(sceneParams());
  m_scene.estimator = ParamValues(estimatorParams());
  m_scene.effects = ParamValues(effectsParams());
  m_scene.render = ParamValues(renderParams());
  m_scene.output = ParamValues(outputParams());
  readScene();
  readCamera();
  if (const toml::array* volumes = tables("volume"))
    for (std::size_t i = 0; i < volumes->size(); ++i)
      readVolume(*volumes->get(i)->as_table(), i);
  if (const toml::array* lights = tables("light"))
    for (std::size_t i = 0; i < lights->size(); ++i)
      readLight(*lights->get(i)->as_table(), i);
  readPlain("estimator", m_scene.estimator);
  applyPreset(m_scene.estimator, m_text.name + ": [estimator]");
  readPlain("effects", m_scene.effects);
  readPlain("render", m_scene.render);
  readPlain("output", m_scene.output);
  checkCombinations(m_scene, m_text.name);
}

void checkCombinations(const SceneFile& scene, const std::string& name) {
  const ParamValues& e = scene.estimator;
  checkEstimator(e, name + ": [estimator]");
  const bool target = scene.render.real("target_error") > 0;
  if (target && !e.text("cache").empty())
    throw ConfigError(name +
                      ": [render]: 'target_error' needs photons of its own to judge by; remove "
                      "estimator.cache");
  if (target && e.text("type") == "photon_map" && e.integer("passes") > 1)
    throw ConfigError(name +
                      ": [render]: 'target_error' goes on by itself; leave estimator.passes at 1");
  // Zeros would say that there is no error.
  const std::vector<std::string> aovs = scene.output.list("aovs");
  if (!target && !(scene.render.real("time_limit") > 0) &&
      std::find(aovs.begin(), aovs.end(), "error") != aovs.end())
    throw ConfigError(name +
                      ": [output]: the layer 'error' of 'aovs' is estimated under "
                      "render.target_error or render.time_limit alone; set one of them");
  const double limit = scene.render.real("memory_limit");
  if (limit < 0 && limit != -1)
    throw ConfigError(name +
                      ": [render]: 'memory_limit' must be -1 (none), 0 (85 % of what is "
                      "free) or a number of GiB");
}

}  // namespace photosphere::scene
