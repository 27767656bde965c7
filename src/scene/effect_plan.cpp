#include "effect_plan.h"

#include <fmt/format.h>

#include <cmath>

#include "photosphere/core/error.h"

namespace photosphere::scene {

namespace {

// Pixels; a tenth of the pixel filter's width.
constexpr double kUnseenBlur = 0.3;

class EffectPlan {
 public:
  EffectPlan(const SceneFile& scene, FrameSetup& setup) : m_scene(scene), m_setup(setup) {}

  void decide() {
    Effects& e = m_setup.effects;
    const transport::Medium& medium = *m_setup.medium;
    const bool glows = medium.emission() != nullptr;
    const bool lamps = !m_setup.lights.empty();
    const std::string inert = !(medium.majorants().maximum() > 0) ? "there is no smoke"
                              : medium.maximumAlbedo() <= 0 ? "the smoke only absorbs (albedo 0)"
                                                            : "";
    const std::string dark = !inert.empty() ? inert : lamps ? "" : "there is no light";
    const bool single = m_scene.estimator.text("type") == "single";
    e.emission = unlessOff("emission", glows ? "" : "no volume emits", "a volume emits");
    e.singleScattering = unlessOff("single_scattering", dark, "lights reach smoke that scatters");
    e.multipleScattering = unlessOff(
        "multiple_scattering",
        single                   ? "estimator.type is single"
        : glows && inert.empty() ? ""
                                 : dark,
        lamps ? "lights reach smoke that scatters" : "smoke scatters the light that it gives off");
    e.shadows = unlessOff("shadows", dark, "smoke casts shadows on itself");
    chromatic();
    e.motionBlur = note("motion_blur", false, "no volume has a velocity");
    depthOfField();
    bool surroundings = false;
    for (const LightEntry& light : m_scene.lights)
      surroundings = surroundings || light.type == "environment";
    e.environment = unlessOff("environment", surroundings ? "" : "there is no environment light",
                              "an environment shines");
  }

 private:
  bool note(const std::string& name, bool on, const std::string& why) {
    m_setup.effectStates.push_back({name, on, why});
    return on;
  }
  // @param never  why it cannot contribute; empty when it can
  bool unlessOff(const std::string& name, const std::string& never, const std::string& why) {
    if (m_scene.effects.text(name) == "off") return note(name, false, "off in the scene");
    return never.empty() ? note(name, true, why) : note(name, false, never);
  }
  // Off where the widest blur in the smoke is less than a pixel filter sees.
  void depthOfField() {
    const ParamValues& camera = m_scene.camera;
    const double fstop = camera.real("fstop");
    const std::string& wish = m_scene.effects.text("depth_of_field");
    bool& on = m_setup.effects.depthOfField;
    on = false;
    if (wish == "off") {
      note("depth_of_field", false, "off in the scene");
    } else if (!(fstop > 0)) {
      note("depth_of_field", false, "the camera is a pinhole");
    } else if (m_scene.cameraType != "perspective") {
      note("depth_of_field", false, "only a perspective camera has a lens");
    } else {
      const render::Lens lens = lensOf(camera, fstop);
      const double blur = widestBlur(lens);
      on = wish == "on" || blur > kUnseenBlur;
      note("depth_of_field", on,
           fmt::format("the lens blurs the smoke over up to {:.2g} pixels", blur));
      if (on) m_setup.lens = lens;
    }
  }
  // Focal length over twice the f-number; in focus by default: the middle of the smoke.
  render::Lens lensOf(const ParamValues& camera, double fstop) const {
    const double millimetres =
        camera.given("focal_length")
            ? camera.real("focal_length")
            : camera.real("horizontal_aperture") / 2 / std::tan(horizontalFov(camera) * kPi / 360);
    const double focus = camera.real("focus_distance");
    return {millimetres / 1000 / m_setup.space.metersPerUnit / (2 * fstop),
            focus > 0 ? focus : std::max(1e-6, along(m_setup.worldBounds.center()))};
  }
  double along(const Vec3d& p) const {
    return glm::dot(p - m_setup.camera->position(), m_setup.camera->viewDirection());
  }
  // Diameter of the circle of confusion at the ends of the smoke [pixels].
  double widestBlur(const render::Lens& lens) const {
    const Box3d& box = m_setup.worldBounds;
    if (box.empty()) return 0;
    double nearest = 1e300, farthest = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const double d =
          along({corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                 corner & 4 ? box.max.z : box.min.z});
      nearest = std::min(nearest, d);
      farthest = std::max(farthest, d);
    }
    const double tanHalf = std::tan(horizontalFov(m_scene.camera) * kPi / 360);
    const double pixels = m_setup.camera->resolution().x / (2 * tanHalf);
    const auto blur = [&](double d) {
      return 2 * lens.radius * pixels * std::abs(1 / std::max(d, 1e-6) - 1 / lens.focusDistance);
    };
    return std::max(blur(nearest), blur(farthest));
  }

  void chromatic() {
    std::string coloured = m_setup.medium->isGrey() ? "" : "an albedo is coloured";
    const transport::Emission* emission = m_setup.medium->emission();
    if (emission && !emission->isGrey()) coloured = "the emission is coloured";
    for (const auto& light : m_setup.lights)
      if (!light->isGrey()) coloured = fmt::format("light '{}' is coloured", light->name());
    const std::string& wish = m_scene.effects.text("chromatic");
    if (wish == "off" && !coloured.empty())
      throw ConfigError(
          fmt::format("[effects]: chromatic = \"off\", but {}; one channel cannot "
                      "hold that, so make it grey or leave chromatic at auto",
                      coloured));
    m_setup.effects.chromatic =
        wish == "on" ? note("chromatic", true, "on in the scene")
                     : note("chromatic", !coloured.empty(),
                            coloured.empty() ? "lights, albedos and emission are grey" : coloured);
  }

  const SceneFile& m_scene;
  FrameSetup& m_setup;
};

}  // namespace

double horizontalFov(const ParamValues& camera) {
  if (camera.given("focal_length") || camera.given("horizontal_aperture"))
    return 2 * std::atan(camera.real("horizontal_aperture") / 2 / camera.real("focal_length")) *
           180 / kPi;
  return camera.real("fov");
}

void planEffects(const SceneFile& scene, FrameSetup& setup) {
  EffectPlan(scene, setup).decide();
}

}  // namespace photosphere::scene
