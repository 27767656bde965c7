#pragma once
// The scene file (TOML): what a user writes, parsed and checked against option rows. The contract
// is the options' own rows; every key has one.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "photosphere/core/param.h"
#include "photosphere/scene/keys.h"

namespace photosphere::scene {

/// One `[[volume]]`.
struct VolumeEntry {
  ParamValues values;  ///< volumeParams()
  std::string
      albedoGrid;  ///< where `albedo` names a grid; else empty and `values` holds the number
  std::string phase = "henyey_greenstein";  ///< phase plug-in
  ParamValues phaseValues;                  ///< that plug-in's rows
  bool emits = false;                       ///< `emission` was given
  ParamValues emission;                     ///< emissionParams()
  Tracks keys, phaseKeys, emissionKeys;     ///< of the three sets of values
  std::string where;  ///< "scene.toml:12: [[volume]] 0", begins messages about it
};

/// One `[[light]]`.
struct LightEntry {
  std::string type;    ///< light plug-in
  ParamValues values;  ///< lights::lightParams() and the plug-in's rows
  Tracks keys;
  std::string where;
};

/// A scene as written, with every default filled in. Paths are as written; see `resolvePath`.
struct SceneFile {
  std::string path;              ///< of the file; empty for a scene made by sceneForVolume
  std::filesystem::path folder;  ///< what relative paths are relative to
  ParamValues scene;
  std::string cameraType = "perspective";
  ParamValues camera;  ///< cameras::cameraParams() and the plug-in's rows
  std::string cameraWhere;
  Tracks cameraKeys;
  Tracks shot;  ///< of `camera.file`: `matrix` and, where the file says so, kShotFov
  std::vector<VolumeEntry> volumes;
  std::vector<LightEntry> lights;
  ParamValues estimator, effects, render, output;
  /// NaN, infinite and negative values of caches and of environments' pictures count as zero, and
  /// particles that have them are left out; else they end the frame (exit 4).
  bool allowInvalid = false;
  /// What sceneForVolume chose, one sentence each; empty for a scene that was read.
  std::vector<std::string> choices;

  /// An absolute path as it is, a relative one below `folder`; an empty one stays empty.
  std::string resolvePath(const std::string& written) const;
  /// True when neither `position`, `matrix` nor `file` places the camera: it then frames the smoke.
  bool framesSmoke() const;
  /// Hash of all that pixels depend on, but not of the caches' content, as 16 hex digits.
  std::string hash() const;
};

/// Key of SceneFile::shot: vertical field of view [degrees].
inline constexpr std::string_view kShotFov = "vertical fov";

/// The scene as it stands at a time [frames]: keyed values are what they are then. The keys stay,
/// so that the result can be asked for other times. @throws ConfigError
SceneFile sceneAt(const SceneFile& scene, double time);
/// The camera's values alone; of a `.chan` file as `matrix` and `fov`, for the scene's resolution.
ParamValues cameraAt(const SceneFile& scene, double time);

/// Rows of the tables that belong to no plug-in: for --help and `photosphere list`.
std::span<const Param> sceneParams();
std::span<const Param> volumeParams();
/// Keys of `emission`, an inline table of a volume.
std::span<const Param> emissionParams();
std::span<const Param> estimatorParams();
std::span<const Param> effectsParams();
std::span<const Param> renderParams();
std::span<const Param> outputParams();

/// A named set of values of [estimator], for `preset`. Keys given beside it win.
struct PresetValue {
  std::string_view key, value;
};
struct Preset {
  std::string_view name, help;
  std::span<const PresetValue> values;
};
std::span<const Preset> estimatorPresets();

/// Reads and checks a scene file.
/// @param sets  `dotted.path=value` with the value as TOML, else as a string:
///              `volume.0.density_scale=4`, `light.0.intensity=2`; missing tables are created
/// @throws InputMissingError when the file cannot be opened; ConfigError (`file:line: [table]:
/// ...`)
///         for text that is not TOML, for an unknown table, key or value (listing the known ones),
///         for values out of range, for what the contract knows but this version does not serve,
///         and for a file without a volume
SceneFile loadScene(const std::filesystem::path& path, const std::vector<std::string>& sets = {});

/// The same from text. @param name  stands for the file in messages
SceneFile parseScene(const std::string& text, const std::string& name,
                     const std::filesystem::path& folder,
                     const std::vector<std::string>& sets = {});

/// TOML that loadScene reads back to the same scene, from any folder: paths become absolute.
std::string dumpScene(const SceneFile& scene);

/// The scene of `photosphere render FILE.vdb`: the named or only fog grid (or the points),
/// extinction scaled to a useful optical depth, a camera that frames the smoke and one key light.
/// `choices` says what was chosen and why.
/// @param path  any cache that module `caches` reads; a path with `####` uses the frame nearest the
///              middle that has smoke. Where none has, a cube stands in its place for the camera
/// @param sets          applied over what was chosen
/// @param allowInvalid  as SceneFile::allowInvalid, which it sets
/// @throws InputMissingError, InputError, ConfigError
SceneFile sceneForVolume(const std::filesystem::path& path,
                         const std::vector<std::string>& sets = {}, bool allowInvalid = false);

}  // namespace photosphere::scene
