#include "light_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "photosphere/core/error.h"
#include "photosphere/core/registry.h"

namespace photosphere::scene {

namespace {

// What all sources send, as photons carry it: each the power of all, by weights of up to ten, times
// its way through the smoke. Past a float's range no sum of it is a number.
class SentPower {
 public:
  explicit SentPower(const transport::Medium& medium)
      : m_bounds(transport::boundingSphere(medium)), m_dark(medium.bounds().empty()) {
    constexpr double kHeaviest = 16;
    m_most = static_cast<double>(std::numeric_limits<float>::max()) /
             (kHeaviest * std::max(1.0, 2 * m_bounds.radius));
  }

  /// @param power  of the largest channel [W]
  /// @param what   the light or volume that shines, as messages name it
  /// @param key    what lowers it
  void add(double power, const std::string& what, std::string_view key) {
    if (m_dark) return;
    m_sum += power;
    if (m_sum <= m_most) return;  // no number is not
    throw ConfigError(
        fmt::format("{}: with it, {:.3g} W set out toward the smoke, more than the {:.3g} W that "
                    "photons can carry through it; lower '{}'",
                    what, m_sum, m_most, key));
  }
  void add(const lights::Light& light, const std::string& what) {
    if (m_dark) return;
    const Vec3d power(light.roughPower(m_bounds));
    const bool numbers = std::isfinite(power.x + power.y + power.z);
    add(numbers ? lights::largestPower(Rgb(power)) : kInfinity, what, "intensity");
  }

 private:
  lights::BoundingSphere m_bounds;
  bool m_dark;
  double m_most = 0, m_sum = 0;
};

// Which volume it is cannot be told from their sum: the first that may be.
void addEmission(const SceneFile& scene, const transport::Medium& medium, SentPower& sent) {
  if (!medium.emission()) return;
  const auto volume = std::find_if(scene.volumes.begin(), scene.volumes.end(),
                                   [](const VolumeEntry& entry) { return entry.emits; });
  sent.add(medium.emission()->birthPower(),
           volume == scene.volumes.end() ? scene.path : volume->where, "emission.scale");
}

void heedInvalid(const SceneFile& scene, const lights::Light& light, const std::string& file,
                 FrameSetup& setup) {
  const auto found = light.invalidContent();
  if (!found) return;
  if (!found->finite && !scene.allowInvalid)
    throw InputError(file, fmt::format("a light's picture holds {}; clean it, or give "
                                       "--allow-invalid to treat them as zero",
                                       found->what));
  setup.notes.push_back(fmt::format("{}: {}; all are treated as zero", file, found->what));
}

}  // namespace

void buildLights(const SceneFile& scene, FrameSetup& setup) {
  SentPower sent(*setup.medium);
  addEmission(scene, *setup.medium, sent);
  for (const LightEntry& entry : scene.lights) {
    if (entry.type == "environment" && scene.effects.text("environment") == "off") continue;
    const lights::LightPlugin& plugin =
        findPlugin(lights::lightModels(), entry.type, "light type", entry.where);
    std::string file;
    try {
      ParamValues values = entry.values;
      if (values.given("file")) {
        file = scene.resolvePath(values.text("file"));
        values.set("file", file, entry.where);
      }
      setup.lights.push_back(plugin.create(values, setup.space));
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("{}: {}", entry.where, error.what()));
    }
    lights::Light& light = *setup.lights.back();
    light.setName(entry.values.text("name"));
    heedInvalid(scene, light, file, setup);
    sent.add(light, entry.where);
  }
}

}  // namespace photosphere::scene
