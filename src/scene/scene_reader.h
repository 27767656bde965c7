#pragma once
// Tables of a parsed scene file into option values.

#include "photosphere/scene/scene_file.h"
#include "toml_text.h"

namespace photosphere::scene {

/// Option rows in one list, the plug-in's after those common to its kind.
std::vector<Param> joinRows(std::span<const Param> common, std::span<const Param> own);

/// Text as a quoted TOML string.
std::string tomlText(const std::string& text);

/// A node as text, or as a value that ParamValues checks against its row.
/// @param place  begins messages @throws ConfigError
std::string textOf(const toml::node& node, std::string_view key, const std::string& place);
ParamValue valueOf(const toml::node& node, std::string_view key, const std::string& place);

bool hasRow(const ParamValues& values, std::string_view key);

class SceneReader {
 public:
  SceneReader(const TomlText& text, SceneFile& scene) : m_text(text), m_scene(scene) {}
  /// @throws ConfigError
  void read();

 private:
  std::string where(const toml::node& node, const std::string& dotted,
                    const std::string& table) const {
    return m_text.where(node, dotted, table);
  }
  const toml::table* table(const std::string& name) const;
  const toml::array* tables(const std::string& name) const;
  void readPlain(const std::string& name, ParamValues& values) const;
  /// Sets a value that may have keys over time. @param path  of its table, such as `light.0`
  void readAnimated(const std::string& path, const std::string& key, const toml::node& node,
                    ParamValues& values, Tracks& keys) const;
  void readKeys(const std::string& path, const Param& row, const toml::array& from,
                ParamValues& values, Tracks& keys) const;
  void readScene();
  void readCamera();
  void readShot();
  void readVolume(const toml::table& from, std::size_t index);
  void readAlbedo(const toml::node& node, const std::string& path, VolumeEntry& entry) const;
  void readPhase(const toml::node& node, const std::string& path, VolumeEntry& entry) const;
  void readEmission(const toml::node& node, const std::string& path, VolumeEntry& entry) const;
  void readLight(const toml::table& from, std::size_t index);

  const TomlText& m_text;
  SceneFile& m_scene;
};

/// Refuses what METHOD.md section 4 does not allow together. @throws ConfigError
void checkCombinations(const SceneFile& scene, const std::string& name);

}  // namespace photosphere::scene
