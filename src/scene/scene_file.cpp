#include "photosphere/scene/scene_file.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>

#include "photosphere/core/error.h"
#include "photosphere/core/hash.h"
#include "photosphere/core/input_file.h"
#include "scene_reader.h"

namespace photosphere::scene {

namespace {

constexpr std::size_t kLongestScene = 16 << 20;  // bytes

// What decides pixels is all of a scene but the places of its files and its output.
enum class DumpPurpose { file, hash };

bool isPath(std::string_view table, std::string_view key) {
  return ((table == "volume" || table == "light" || table == "camera") && key == "file") ||
         (table == "estimator" && key == "cache") ||
         (table == "output" && (key == "file" || key == "preview"));
}

class Dumper {
 public:
  Dumper(const SceneFile& scene, DumpPurpose purpose) : m_scene(scene), m_purpose(purpose) {}

  std::string text() {
    if (m_purpose == DumpPurpose::file)
      for (const std::string& choice : m_scene.choices)
        m_text += "# " + choice + "\n";
    table("scene", "[scene]", m_scene.scene);
    table("camera", "[camera]", m_scene.camera, fmt::format("type = \"{}\"\n", m_scene.cameraType),
          m_scene.cameraKeys);
    if (m_purpose == DumpPurpose::hash) shot();
    for (const VolumeEntry& volume : m_scene.volumes)
      table("volume", "[[volume]]", volume.values, volumeExtras(volume), volume.keys);
    for (const LightEntry& light : m_scene.lights)
      table("light", "[[light]]", light.values, fmt::format("type = \"{}\"\n", light.type),
            light.keys);
    table("estimator", "[estimator]", m_scene.estimator);
    table("effects", "[effects]", m_scene.effects);
    table("render", "[render]", m_scene.render);
    if (m_purpose == DumpPurpose::file) table("output", "[output]", m_scene.output);
    return m_text;
  }

 private:
  std::string volumeExtras(const VolumeEntry& volume) const {
    std::string extras;
    if (!volume.albedoGrid.empty())
      extras += fmt::format("albedo = {}\n", tomlText(volume.albedoGrid));
    extras += fmt::format("phase = {{ type = \"{}\"", volume.phase);
    for (const Param& row : volume.phaseValues.rows())
      if (row.served)
        extras +=
            fmt::format(", {} = {}", row.name, written(row, volume.phaseValues, volume.phaseKeys));
    extras += " }\n";
    if (!volume.emits) return extras;
    std::vector<std::string> keys;
    for (const Param& row : volume.emission.rows())
      if (volume.emission.given(row.name))
        keys.push_back(
            fmt::format("{} = {}", row.name, written(row, volume.emission, volume.emissionKeys)));
    return extras + fmt::format("emission = {{ {} }}\n", fmt::join(keys, ", "));
  }

  // A value, or its keys.
  static std::string written(const Param& row, const ParamValues& values, const Tracks& keys) {
    const auto track = keys.find(row.name);
    return track == keys.end() ? values.format(row.name) : formatTrack(row, track->second);
  }

  // What a camera's file holds: its name alone would not do, as it is edited in place.
  void shot() {
    for (const auto& [name, track] : m_scene.shot)
      for (const Key& key : track)
        m_text += fmt::format("{} {} {}\n", name, key.frame, fmt::join(key.value, " "));
  }

  // Given values as they are; the others as comments with their defaults, ready to be edited.
  void table(std::string_view name, std::string_view head, const ParamValues& values,
             const std::string& extras = {}, const Tracks& keys = {}) {
    m_text += fmt::format("{}{}\n{}", m_text.empty() ? "" : "\n", head, extras);
    std::string defaults;
    for (const Param& row : values.rows()) {
      if (!row.served || (name == "volume" && row.name == "albedo" && extras.starts_with("albedo")))
        continue;
      // A frame's values of what a camera's file says.
      if (name == "camera" && m_scene.shot.contains(row.name == "fov" ? kShotFov : row.name))
        continue;
      std::string value = written(row, values, keys);
      const bool path = isPath(name, row.name) && !values.text(row.name).empty();
      const bool frames = name == "scene" && row.name == "frames";
      // A picture of the surroundings is known by its name alone; smoke has hashes of its own, and
      // what a camera's file holds stands below.
      const bool named = path && name == "light";
      if (((path && !named) || frames) && m_purpose == DumpPurpose::hash) continue;
      if (path && m_purpose == DumpPurpose::file) {
        ParamValues absolute = values;
        absolute.set(row.name, m_scene.resolvePath(values.text(row.name)), "dump");
        value = absolute.format(row.name);
      }
      const std::string unit = row.unit.empty() ? "" : fmt::format(" [{}]", row.unit);
      if (values.given(row.name) || m_purpose == DumpPurpose::hash)
        m_text += fmt::format("{} = {}\n", row.name, value);
      else
        defaults += fmt::format("# {} = {}  # {}{}\n", row.name, value, row.help, unit);
    }
    m_text += defaults;
  }

  const SceneFile& m_scene;
  DumpPurpose m_purpose;
  std::string m_text;
};

}  // namespace

std::string tomlText(const std::string& text) {
  static constexpr Param row = {
      .name = "text", .type = ParamType::text, .unit = "", .defaultText = "", .help = "any"};
  ParamValues values(std::span<const Param>(&row, 1));
  values.set("text", text, "text");
  return values.format("text");
}

std::string SceneFile::resolvePath(const std::string& written) const {
  if (written.empty()) return written;
  const std::filesystem::path p(written);
  return p.is_absolute() ? written : (folder / p).lexically_normal().string();
}

bool SceneFile::framesSmoke() const {
  return !camera.given("position") && !camera.given("matrix") && shot.empty();
}

std::string SceneFile::hash() const {
  Hasher hasher;
  hasher.text(Dumper(*this, DumpPurpose::hash).text());
  return hasher.hex();
}

ParamValues cameraAt(const SceneFile& scene, double time) {
  ParamValues values = scene.camera;
  setToTime(scene.cameraKeys, time, values, scene.cameraWhere);
  const auto place = scene.shot.find("matrix");
  if (place == scene.shot.end()) return values;
  values.set("matrix", valueAt(ParamType::matrix, place->second, time), scene.cameraWhere);
  const auto fov = scene.shot.find(kShotFov);
  if (fov == scene.shot.end() || scene.cameraType != "perspective") return values;
  const double vertical = valueAt(ParamType::real, fov->second, time).front() * kPi / 180;
  const Vec2d size = values.vec2("resolution");
  const double horizontal = 2 * std::atan(std::tan(vertical / 2) * size.x / size.y);
  values.set("fov", horizontal * 180 / kPi, scene.cameraWhere);
  return values;
}

SceneFile sceneAt(const SceneFile& scene, double time) {
  SceneFile at = scene;
  at.camera = cameraAt(scene, time);
  for (VolumeEntry& volume : at.volumes) {
    setToTime(volume.keys, time, volume.values, volume.where);
    setToTime(volume.phaseKeys, time, volume.phaseValues, volume.where);
    setToTime(volume.emissionKeys, time, volume.emission, volume.where);
  }
  for (LightEntry& light : at.lights)
    setToTime(light.keys, time, light.values, light.where);
  return at;
}

SceneFile parseScene(const std::string& text, const std::string& name,
                     const std::filesystem::path& folder, const std::vector<std::string>& sets) {
  const TomlText toml = parseToml(text, name, sets);
  SceneFile scene;
  scene.folder = folder;
  SceneReader(toml, scene).read();
  return scene;
}

SceneFile loadScene(const std::filesystem::path& path, const std::vector<std::string>& sets) {
  checkReadable(path, "a scene file");
  std::ifstream in(path, std::ios::binary);
  std::string text;
  // A device may have no end.
  for (char block[1 << 14]; in && text.size() <= kLongestScene;) {
    in.read(block, sizeof block);
    text.append(block, static_cast<std::size_t>(in.gcount()));
  }
  if (!in.good() && !in.eof()) throw InputMissingError(path.string(), "cannot be read");
  if (text.size() > kLongestScene)
    throw ConfigError(fmt::format("{}: is longer than {} MiB, and no scene file", path.string(),
                                  kLongestScene >> 20));
  const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  SceneFile scene = parseScene(text, path.string(), folder, sets);
  scene.path = path.string();
  // An empty file is no scene of nothing: it was cut off, or never written.
  if (scene.volumes.empty())
    throw ConfigError(scene.path +
                      ": there is no [[volume]]; a scene needs one, whose 'file' names "
                      "its cache");
  return scene;
}

std::string dumpScene(const SceneFile& scene) {
  return Dumper(scene, DumpPurpose::file).text();
}

}  // namespace photosphere::scene
