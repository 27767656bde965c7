#include "hard_cases.h"

#include <fmt/format.h>

#include <cmath>

namespace photosphere::study {

namespace {

constexpr std::uint64_t kFewParticles = 1000;
constexpr double kForwardG = 0.95;
constexpr double kThinning = 0.05;

std::string vec(const Vec3d& v) {
  return fmt::format("[{:.9g}, {:.9g}, {:.9g}]", v.x, v.y, v.z);
}

std::vector<std::string> eachVolume(const scene::SceneFile& scene, const std::string& key,
                                    const auto& value) {
  std::vector<std::string> sets;
  for (std::size_t i = 0; i < scene.volumes.size(); ++i)
    sets.push_back(fmt::format("volume.{}.{}={}", i, key, value(scene.volumes[i])));
  return sets;
}

std::vector<std::string> phaseSets(const scene::SceneFile& scene, double g) {
  return eachVolume(scene, "phase", [g](const scene::VolumeEntry&) {
    return fmt::format("{{ type = \"henyey_greenstein\", g = {} }}", g);
  });
}

// A narrow spot from the side whose cone ends inside the smoke.
std::string hardSpot(const Vec3d& center, double radius) {
  const Vec3d position = center + radius * Vec3d(2.0, -1.2, 1.6);
  const double angle =
      std::atan(0.35 * radius / glm::length(position - center)) * 180 / 3.14159265358979323846;
  return fmt::format(
      "[{{ type = \"spot\", name = \"hard\", position = {}, target = {}, intensity = {:.9g}, "
      "cone_angle = {:.9g}, cone_edge = 0.0 }}]",
      vec(position), vec(center), 60 * radius * radius, angle);
}

}  // namespace

std::vector<HardCase> basisCases(const scene::SceneFile& scene, bool quick) {
  std::vector<HardCase> cases;
  for (const double g : quick ? std::vector{0.5} : std::vector{-0.5, 0.0, 0.5, 0.7, 0.85, 0.95})
    cases.push_back({fmt::format("g = {}", g), "bases compared", phaseSets(scene, g)});
  return cases;
}

std::vector<HardCase> hardCases(const scene::SceneFile& scene, const SceneFacts& facts) {
  const Vec3d center = facts.bounds.center();
  const double radius = 0.5 * glm::length(facts.bounds.max - facts.bounds.min);
  const auto thinner = [](const scene::VolumeEntry& volume) {
    const Vec3d scale = kThinning * volume.values.vec3("density_scale");
    return vec(scale);
  };
  const std::string lamp =
      fmt::format("[{{ type = \"point\", name = \"inside\", position = {}, intensity = {:.9g} }}]",
                  vec(center), 10 * radius * radius);
  return {
      {"few_particles",
       fmt::format("{} particles carry the light of the contenders that store it on particles",
                   kFewParticles),
       {},
       kFewParticles},
      {"forward_phase", fmt::format("Henyey-Greenstein phase with g = {} everywhere", kForwardG),
       phaseSets(scene, kForwardG)},
      {"thin_smoke", fmt::format("extinction multiplied by {}", kThinning),
       eachVolume(scene, "density_scale", thinner)},
      {"light_inside", "one point lamp in the middle of the smoke's box", {"light=" + lamp}},
      {"hard_shadow_edge",
       "one narrow spot with a hard edge that ends inside the smoke",
       {"light=" + hardSpot(center, radius)}},
  };
}

}  // namespace photosphere::study
