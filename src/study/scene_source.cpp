#include "scene_source.h"

#include <algorithm>

#include "photosphere/core/hash.h"

namespace photosphere::study {

namespace {

// Version of what a reference means; to be raised when a default or a definition changes pixels.
constexpr int kReferenceVersion = 1;

// Rows that pixels of a converged frame do not depend on.
bool irrelevant(std::string_view table, std::string_view name) {
  if (table == "volume" || table == "camera") return name == "file";
  if (table == "scene") return name != "meters_per_unit";
  if (table == "render") return name != "filter" && name != "filter_width";
  if (table == "light") return name == "name";
  return false;
}

// Only what differs from its default: a row that a later version adds changes no key.
void hashTable(Hasher& hasher, std::string_view table, const ParamValues& values) {
  hasher.text(table);
  const ParamValues defaults(values.rows());
  for (const Param& row : values.rows()) {
    if (irrelevant(table, row.name)) continue;
    const std::string value = values.format(row.name);
    if (value == defaults.format(row.name)) continue;
    hasher.text(row.name);
    hasher.text(value);
  }
}

// What moves the camera while its shutter is open.
void hashMotion(Hasher& hasher, const scene::Tracks& tracks) {
  for (const auto& [name, track] : tracks) {
    hasher.text(name);
    for (const scene::Key& key : track) {
      hasher.number(key.frame);
      hasher.numbers(key.value.data(), key.value.size());
    }
  }
}

}  // namespace

scene::SceneFile SceneSource::open(const std::vector<std::string>& more) const {
  std::vector<std::string> all = sets;
  all.insert(all.end(), more.begin(), more.end());
  return path.extension() == ".toml" ? scene::loadScene(path, all)
                                     : scene::sceneForVolume(path, all);
}

SceneSource SceneSource::with(const std::vector<std::string>& more) const {
  SceneSource source = *this;
  source.sets.insert(source.sets.end(), more.begin(), more.end());
  return source;
}

std::string referenceKey(const scene::SceneFile& written, std::int64_t frame,
                         const std::string& mediumHash) {
  const scene::SceneFile scene = scene::sceneAt(written, static_cast<double>(frame));
  Hasher hasher;
  hasher.number(kReferenceVersion);
  hasher.number(frame);
  hasher.text(mediumHash);
  hasher.text(scene.cameraType);
  hashTable(hasher, "scene", scene.scene);
  hashTable(hasher, "camera", scene.camera);
  hashMotion(hasher, scene.cameraKeys);
  hashMotion(hasher, scene.shot);
  for (const scene::VolumeEntry& volume : scene.volumes) {
    hasher.text(volume.phase);
    hasher.text(volume.albedoGrid);
    hashTable(hasher, "volume", volume.values);
    hashTable(hasher, "phase", volume.phaseValues);
  }
  for (const scene::LightEntry& light : scene.lights) {
    hasher.text(light.type);
    hashTable(hasher, "light", light.values);
  }
  hashTable(hasher, "effects", scene.effects);
  hashTable(hasher, "render", scene.render);
  return hasher.hex();
}

}  // namespace photosphere::study
