// The scene that `render FILE.vdb` uses: a user starts from a picture and edits.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "axis_depths.h"
#include "medium_setup.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/scene/frame_setup.h"
#include "photosphere/scene/scene_file.h"
#include "photosphere/volume/optical_depth.h"
#include "photosphere/volume/vdb_file.h"
#include "scene_reader.h"
#include "smoke_source.h"

namespace photosphere::scene {

namespace {

constexpr double kFov = 30.0;
constexpr double kAlbedo = 0.9, kAnisotropy = 0.4;

// Irradiance at the smoke's centre [W/m^2]. Smoke this deep of albedo 0.9 and g 0.4 acts like an
// isotropic medium of albedo (1-g) w / (1 - g w) = 0.84, whose diffuse reflectance (1 - s) / (1 +
// s), s = sqrt(1 - 0.84), is 0.43. At about 50 degrees of incidence a thick side then shows 0.43 *
// cos(50) * E / pi = 0.09 E. 2 pi puts it at 0.55 and thin smoke near middle grey, with room
// below 1.
constexpr double kIrradiance = 2.0 * kPi;

bool holds(const std::string& text, std::string_view word) {
  std::string lower = text;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower.find(word) != std::string::npos;
}

std::string chooseDensity(const CacheGrids& cache, std::vector<std::string>& choices) {
  std::vector<std::string> fog;
  for (const volume::Grid& grid : cache.grids) {
    if (grid.kind() != volume::GridKind::scalar || grid.isLevelSet()) continue;
    if (grid.name() == "density") {
      choices.push_back("The grid 'density' is the smoke.");
      return "density";
    }
    if (grid.valueType().starts_with("float") || grid.valueType().starts_with("half") ||
        grid.valueType().starts_with("double"))
      fog.push_back(grid.name());
  }
  if (fog.size() == 1) {
    choices.push_back(fmt::format("The only fog grid, '{}', is the smoke.", fog.front()));
    return fog.front();
  }
  if (cache.grids.empty() && !cache.pointGrids.empty()) {
    choices.push_back("The file holds points alone; they are rasterized.");
    return "density";
  }
  throw InputError(cache.path,
                   fmt::format("no grid is named 'density' and {} could be one (the file has {}); "
                               "say which with -s volume.0.density=NAME",
                               fog.empty() ? "none" : "several", cache.listing()));
}

// Which axis is up is nowhere in a .vdb. Houdini's world is Y up, Blender's Z up; both leave their
// name in metadata. Else the shape decides: smoke rises.
Vec3d chooseUp(const CacheGrids& cache, const Box3d& box, std::vector<std::string>& choices) {
  std::string all;
  if (cache.path.ends_with(".vdb"))
    for (const auto& [key, value] : volume::readVdb(cache.path).metadata)
      all += key + "=" + value + "\n";
  for (const volume::Grid& grid : cache.grids)
    for (const auto& [key, value] : grid.metadata())
      all += key + "=" + value + "\n";
  // Blender's Mantaflow caches name no software, but no other writes these grids together.
  const auto has = [&](std::string_view name) {
    return std::any_of(cache.grids.begin(), cache.grids.end(),
                       [&](const volume::Grid& grid) { return grid.name() == name; });
  };
  const bool houdini = holds(all, "houdini");
  const bool blender = holds(all, "blender") || (has("density") && has("flame") && has("shadow"));
  if (blender != houdini) {
    choices.push_back(blender ? "Z is up: the file is a cache of Blender's."
                              : "Y is up: the file was written by Houdini.");
    return blender ? Vec3d(0, 0, 1) : Vec3d(0, 1, 0);
  }
  const Vec3d e = box.extent();
  if (e.z > 1.2 * e.y && e.z > 1.2 * e.x) {
    choices.push_back("Z is up: the smoke is tallest along Z, and no metadata says otherwise.");
    return {0, 0, 1};
  }
  choices.push_back("Y is up, as nothing in the file says otherwise.");
  return {0, 1, 0};
}

// Whether a voxel is so deep that its density may have been cut off.
bool isPastMeasure(const transport::Medium& medium) {
  return static_cast<double>(medium.majorants().maximum()) * medium.voxelEdge() >
         0.5 * kMostVoxelDepth;
}
// Steps in which the density_scale of a probe goes down, and where they end: past any float's
// range.
constexpr double kThinner = 1e-6, kLeastProbe = 1e-80;

// @param scaled  the density_scale that the medium has
double chooseScale(const transport::Medium& medium, double scaled,
                   std::vector<std::string>& choices) {
  const std::vector<double> depths = axisDepths(medium);
  if (depths.empty() || !(depths[depths.size() / 2] > 0)) return 1.0;
  const double median = depths[depths.size() / 2] / scaled;
  const double high = depths[depths.size() * 9 / 10] / scaled;
  const double scale = volume::roundedToTwoDigits(volume::kSmokeDepth / median);
  choices.push_back(
      fmt::format("density_scale = {:g}: the median optical depth along the axes becomes {:.1f} "
                  "(90 % lie below "
                  "{:.1f}); it would be {:.3g} at scale 1.",
                  scale, median * scale, high * scale, median));
  return scale;
}

std::string vectorText(const Vec3d& v) {
  return fmt::format("[{:.12g}, {:.12g}, {:.12g}]", v.x, v.y, v.z);
}

// A spot above the camera's left shoulder, four radii away, whose cone just holds the smoke.
std::string keyLight(const Box3d& box, const Vec3d& up, const Mat4d& camera, double metersPerUnit,
                     std::vector<std::string>& choices) {
  const double radius = 0.5 * glm::length(box.extent());
  const Vec3d direction = glm::normalize(up - 0.9 * Vec3d(camera[0]) + 0.35 * Vec3d(camera[2]));
  const double distance = 4.0 * radius;
  const double angle = std::asin(1.0 / 4.0) * 180 / kPi * 1.2;
  const double meters = distance * metersPerUnit;
  const double intensity = kIrradiance * meters * meters;  // I = E d^2
  choices.push_back(fmt::format(
      "Key light: a spot from above and the left, {:.4g} away; its intensity of {:.4g} W/sr gives "
      "the centre an irradiance of 2 pi W/m^2, which exposes smoke of this albedo well.",
      distance, intensity));
  return fmt::format(
      "[[light]]\ntype = \"spot\"\nname = \"key\"\nposition = {}\ntarget = {}\nintensity = {:.9g}\n"
      "cone_angle = {:.6g}\ncone_edge = 2.0\n\n",
      vectorText(box.center() + direction * distance), vectorText(box.center()), intensity, angle);
}

std::string volumeText(const std::string& file, const std::string& density, double scale) {
  return fmt::format(
      "[[volume]]\nfile = {}\ndensity = {}\ndensity_scale = {:g}\nalbedo = {:g}\nphase = {{ type = "
      "\"henyey_greenstein\", g = {:g} }}\n\n",
      tomlText(file), tomlText(density), scale, kAlbedo, kAnisotropy);
}

// The overrides that decide what the smoke is, which everything else is chosen from.
std::vector<std::string> volumeSets(const std::vector<std::string>& sets) {
  std::vector<std::string> chosen;
  for (const std::string& set : sets)
    if (set.starts_with("volume.") || set.starts_with("scene.") || set.starts_with("camera.res"))
      chosen.push_back(set);
  return chosen;
}

bool isSet(const std::vector<std::string>& sets, std::string_view key) {
  return std::any_of(sets.begin(), sets.end(), [&](const std::string& set) {
    return set.starts_with(key) && set.substr(key.size()).starts_with("=");
  });
}

bool isAnySet(const std::vector<std::string>& sets, std::initializer_list<std::string_view> keys) {
  return std::any_of(keys.begin(), keys.end(),
                     [&](std::string_view key) { return isSet(sets, key); });
}

// A camera that frames the smoke, less what the overrides say in other words.
std::string cameraText(const Box3d& box, const Vec3d& up, const Mat4d& placement,
                       const std::vector<std::string>& sets, std::vector<std::string>& choices) {
  std::string text = "[camera]\n";
  if (!isAnySet(sets, {"camera.type", "camera.file", "camera.focal_length",
                       "camera.horizontal_aperture"}))
    text += fmt::format("fov = {}\n", kFov);
  if (isAnySet(sets, {"camera.file", "camera.matrix"})) return text + "\n";
  text += fmt::format("up = {}\n", vectorText(up));
  // Another kind of camera knows best where it sees all.
  if (!isSet(sets, "camera.type"))
    text += fmt::format("position = {}\nlook_at = {}\n", vectorText(Vec3d(placement[3])),
                        vectorText(box.center()));
  choices.push_back(
      "The camera frames the smoke from the front, a little from the right and above.");
  return text + "\n";
}

// Frames of a sequence, from its middle outward; 1 of a file alone.
std::vector<std::int64_t> framesFromTheMiddle(const std::string& pattern) {
  if (!hasFrameToken(pattern)) return {1};
  std::vector<std::int64_t> frames = findFrames(pattern);
  if (frames.empty())
    throw InputMissingError(pattern,
                            "no frame of this sequence exists; check its path and its number of #");
  const std::int64_t middle = frames[frames.size() / 2];
  std::stable_sort(frames.begin(), frames.end(), [middle](std::int64_t a, std::int64_t b) {
    return std::abs(a - middle) < std::abs(b - middle);
  });
  return frames;
}

// What everything is chosen from: a first set-up of one frame, which says where the smoke is and
// how deep.
struct Probe {
  std::int64_t frame = 1;
  CacheGrids cache;
  std::string density;
  double scale = 1;  // density_scale of the set-up
  SceneFile scene;
  FrameSetup smoke;
  std::vector<std::string> choices;
};

Probe probeFrame(const std::string& pattern, const std::string& folder, std::int64_t frame,
                 const std::vector<std::string>& sets, bool allowInvalid) {
  Probe probe;
  probe.frame = frame;
  probe.cache = readCacheGrids(framePath(pattern, frame));
  probe.density =
      isSet(sets, "volume.0.density") ? "density" : chooseDensity(probe.cache, probe.choices);
  // At scale 1, or at a lower one, where that would be past measure in a voxel.
  const auto setUpAt = [&](double scale) {
    probe.scale = scale;
    probe.scene =
        parseScene(volumeText(pattern, probe.density, scale), pattern, folder, volumeSets(sets));
    probe.scene.allowInvalid = allowInvalid;
    probe.smoke = setUpFrame(probe.scene, frame);
  };
  setUpAt(1);
  while (!isSet(sets, "volume.0.density_scale") && isPastMeasure(*probe.smoke.medium) &&
         probe.scale > kLeastProbe)
    setUpAt(probe.scale * kThinner);
  return probe;
}

// Of the frame nearest the middle that has smoke, else of the middle one.
Probe probeSequence(const std::string& pattern, const std::string& folder,
                    const std::vector<std::string>& sets, bool allowInvalid) {
  const std::vector<std::int64_t> frames = framesFromTheMiddle(pattern);
  Probe probe = probeFrame(pattern, folder, frames.front(), sets, allowInvalid);
  for (std::size_t i = 1; i < frames.size() && probe.smoke.worldBounds.empty(); ++i)
    if (Probe next = probeFrame(pattern, folder, frames[i], sets, allowInvalid);
        !next.smoke.worldBounds.empty())
      probe = std::move(next);
  if (probe.smoke.worldBounds.empty())
    probe.choices.emplace_back(
        "There is no smoke; the camera frames a cube of edge 1 about the origin.");
  else if (hasFrameToken(pattern))
    probe.choices.insert(
        probe.choices.begin(),
        fmt::format("Camera and density_scale are chosen from frame {}, {}.", probe.frame,
                    probe.frame == frames.front()
                        ? "the middle of the sequence"
                        : "the nearest to the middle of the sequence that has smoke"));
  return probe;
}

}  // namespace

SceneFile sceneForVolume(const std::filesystem::path& path, const std::vector<std::string>& sets,
                         bool allowInvalid) {
  const std::string pattern = std::filesystem::absolute(path).lexically_normal().string();
  const std::string folder = std::filesystem::path(pattern).parent_path().string();
  Probe probe = probeSequence(pattern, folder, sets, allowInvalid);
  std::vector<std::string> choices = std::move(probe.choices);
  const bool smoke = !probe.smoke.worldBounds.empty();
  const Box3d box = smoke ? probe.smoke.worldBounds : Box3d{Vec3d(-0.5), Vec3d(0.5)};
  double scale = 1;
  if (isSet(sets, "volume.0.density_scale"))
    scale = probe.scene.volumes.front().values.vec3("density_scale").x;
  else if (smoke)
    scale = chooseScale(*probe.smoke.medium, probe.scale, choices);
  const Vec3d up = chooseUp(probe.cache, box, choices);
  const Mat4d camera =
      frameBox(box, box.center(), up, kFov, Vec2i(probe.scene.camera.vec2("resolution")));
  std::string text = cameraText(box, up, camera, sets, choices);
  text += volumeText(pattern, probe.density, scale);
  if (!isSet(sets, "light"))
    text += keyLight(box, up, camera, probe.smoke.space.metersPerUnit, choices);
  if (!isSet(sets, "volume.0.albedo"))
    choices.push_back(fmt::format("albedo = {}: bright smoke.", kAlbedo));
  if (!isAnySet(sets, {"volume.0.phase", "volume.0.phase.g"}))
    choices.push_back(fmt::format("g = {}: smoke that scatters forward.", kAnisotropy));
  SceneFile scene = parseScene(text, pattern, folder, sets);
  scene.choices = std::move(choices);
  scene.allowInvalid = allowInvalid;
  return scene;
}

}  // namespace photosphere::scene
