#include "effect_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "blur.h"
#include "light_bounds.h"
#include "photosphere/core/error.h"
#include "photosphere/phase/phase.h"
#include "pre_render.h"
#include "unseen_volumes.h"

namespace photosphere::scene {

namespace {

// What bounds cannot say of pictures that are looked at here and there: differences between
// neighbours may be this many times as large as the largest that was met.
constexpr double kSafety = 2.0;

// What is said about one effect.
struct Decision {
  bool on = false;
  std::string why;
  std::optional<double> bound = std::nullopt;
};

class EffectPlan {
 public:
  EffectPlan(const SceneFile& scene, bool forOtherViews, FrameSetup& setup)
      : m_scene(scene),
        m_setup(setup),
        m_tolerance(scene.effects.real("tolerance")),
        m_forOtherViews(forOtherViews),
        m_single(scene.estimator.text("type") == "single") {}

  void decide() {
    Effects& e = m_setup.effects;
    Decision lens = prepareLens();
    m_allLamps = m_setup.lights.size();
    m_glowed = glows();
    boundLight();
    e.environment = environment();
    startWithAllThatShines();

    // In the order of what leaving them out saves.
    Decision multiple = multipleScattering();
    m_multiple = multiple.on;
    const Decision volumes = dropUnseenVolumes();
    Decision lamps = dropDarkLamps();
    startWithAllThatShines();
    // Of less smoke and fewer lamps, it may fit.
    if (multiple.on) multiple = multipleScattering();
    m_multiple = multiple.on;
    dropFaintLamps(lamps);
    Decision emission = this->emission();
    Decision single = singleScattering();
    e.emission = emission.on;
    e.singleScattering = single.on;
    e.multipleScattering = multiple.on;
    Decision shadows = this->shadows();
    e.shadows = shadows.on;
    const Decision motion = motionBlur();
    e.motionBlur = motion.on;
    depthOfField(lens);

    note("emission", emission);
    note("single_scattering", single);
    note("multiple_scattering", multiple);
    note("shadows", shadows);
    chromatic();
    note("motion_blur", motion);
    note("depth_of_field", lens);
    note("environment", m_environment);
    note("lights", lamps);
    note("volumes", volumes);
    directions();
  }

 private:
  bool is(std::string_view name, std::string_view wish) const {
    return m_scene.effects.text(name) == wish;
  }
  bool isOff(std::string_view name) const { return is(name, "off"); }
  bool isOn(std::string_view name) const { return is(name, "on"); }
  bool glows() const { return m_setup.medium->emission() != nullptr; }
  void note(const std::string& name, const Decision& decision) {
    m_setup.effectStates.push_back({name, decision.on, decision.why, decision.bound});
  }

  // On or off as the scene says, else off where it adds exactly nothing.
  // @param never  why it cannot contribute; empty when it can
  Decision unlessNever(std::string_view name, const std::string& never, std::string why) const {
    if (isOff(name)) return {false, "off in the scene"};
    if (never.empty()) return {true, std::move(why)};
    if (isOn(name)) return {true, fmt::format("on in the scene, although {}", never)};
    return {false, never, 0.0};
  }

  // Takes its share of the tolerance where what would be left out fits into what remains.
  // @param most  of any pixel [W m^-2 sr^-1]
  std::optional<double> afford(double most) {
    if (!(m_tolerance > m_spent) || !std::isfinite(most)) return std::nullopt;
    // No picture of these lamps is brighter: it need not be looked at to see that this is too much.
    double brightest = m_bounds->glow();
    for (const LampBound& lamp : m_lamps)
      brightest += lamp.single + lamp.background;
    if (!(most <= (m_tolerance - m_spent) * brightest)) return std::nullopt;
    const double mean = picture().meanRadiance;
    if (!(mean > 0) || !(most / mean <= m_tolerance - m_spent)) return std::nullopt;
    m_spent += most / mean;
    return most / mean;
  }
  static std::string share(double bound) {
    return fmt::format("at most {:.2g} of the smoke's mean radiance", bound);
  }

  // Of everything that is not scattered twice or more, before anything else is left out.
  const PreRender& picture() {
    if (!m_picture) {
      Effects effects = m_setup.effects;
      effects.shadows = !isOff("shadows");
      m_picture = preRender(m_setup, effects);
    }
    return *m_picture;
  }

  // Of the smoke and the lamps that are left.
  void boundLight() {
    const transport::Medium& medium = *m_setup.medium;
    m_scatters = medium.majorants().maximum() > 0 && medium.maximumAlbedo() > 0;
    m_bounds.reset();
    if (!medium.bounds().empty())
      m_bounds.emplace(smokeBounds(medium), seenDirections(m_scene, m_setup));
    m_lamps.clear();
    for (const auto& light : m_setup.lights)
      m_lamps.push_back(m_bounds ? m_bounds->lamp(*light) : LampBound{});
  }

  void startWithAllThatShines() {
    m_setup.effects.emission = glows() && !isOff("emission");
    m_setup.effects.singleScattering =
        !m_setup.lights.empty() && m_scatters && !isOff("single_scattering");
  }

  // Volumes that no ray meets, and whose light and shadows do not carry over to those in view.
  Decision dropUnseenVolumes() {
    const std::size_t all = m_setup.medium->volumes().size();
    if (all == 0) return {false, "there is none"};
    if (m_forOtherViews)
      return {true, fmt::format("{} of {}: the light is for any view", all, all)};
    const UnseenVolumes volumes(m_scene, m_setup, seenDirections(m_scene, m_setup));
    std::vector<bool> out = volumes.unseen();
    const auto count = [&] { return std::count(out.begin(), out.end(), true); };
    const auto unseen = count();
    std::optional<double> bound;
    while (count() > 0 && !bound) {
      const std::vector<double> most = volumes.effects(out, m_setup.lights, m_multiple);
      const double sum = std::accumulate(most.begin(), most.end(), 0.0);
      bound = sum > 0 ? afford(sum) : 0.0;
      // What acts most stays, and the others act on it too.
      if (!bound) {
        const auto strongest = std::max_element(most.begin(), most.end()) - most.begin();
        out[static_cast<std::size_t>(strongest)] = false;
      }
    }
    const std::string beyond = fmt::format("{} of {} out of view", unseen, all);
    if (unseen == 0) return {true, beyond};
    if (!bound) return {true, beyond + ": light or shadows may reach what is in view"};
    const auto left = count();
    leaveOut(out, m_setup);
    boundLight();
    return {left < static_cast<std::ptrdiff_t>(all),
            fmt::format("{}; light and shadows of {} {}", beyond, left,
                        *bound > 0 ? "change what is in view by " + share(*bound)
                                   : "do not reach what is in view"),
            bound};
  }

  bool environment() {
    bool surroundings = false, shines = false;
    for (std::size_t i = 0; i < m_setup.lights.size(); ++i) {
      const double background = m_setup.lights[i]->reach({}).background;
      surroundings = surroundings || background > 0 || m_setup.lights[i]->isUniform();
      shines = shines || background > 0;
    }
    for (const LightEntry& light : m_scene.lights)
      surroundings = surroundings || light.type == "environment";
    m_environment = unlessNever("environment",
                                shines         ? ""
                                : surroundings ? "the environment is black"
                                               : "there is no environment light",
                                "an environment shines");
    return m_environment.on;
  }

  void dropLamp(std::size_t i) {
    m_setup.lights.erase(m_setup.lights.begin() + static_cast<std::ptrdiff_t>(i));
    m_lamps.erase(m_lamps.begin() + static_cast<std::ptrdiff_t>(i));
  }

  // Lamps that light no smoke and that no ray meets.
  Decision dropDarkLamps() {
    const std::size_t all = m_setup.lights.size();
    if (!m_bounds) return {all > 0, all > 0 ? "there is no smoke" : "there is none"};
    std::vector<std::string> dark;
    for (std::size_t i = all; i-- > 0;)
      if (!(m_setup.lights[i]->reach(transport::boundingSphere(*m_setup.medium)).fluence > 0) &&
          !(m_lamps[i].background > 0)) {
        dark.push_back(fmt::format("'{}'", m_setup.lights[i]->name()));
        dropLamp(i);
      }
    if (all == 0) return {false, "there is none"};
    if (dark.empty()) return {true, fmt::format("{} of {} shine on the smoke", all, all)};
    std::reverse(dark.begin(), dark.end());
    return {all > dark.size(),
            fmt::format("{} of {} shine on the smoke; no light of {} reaches it", all - dark.size(),
                        all, fmt::join(dark, ", ")),
            0.0};
  }

  // With what of it is simulated.
  double adds(const LampBound& lamp) const {
    return lamp.single + lamp.background + (m_multiple ? lamp.multiple : 0.0);
  }

  // Lamps beside which others are so bright that they may be left out.
  void dropFaintLamps(Decision& lamps) {
    if (m_forOtherViews || isOn("single_scattering") || isOn("multiple_scattering")) return;
    std::vector<std::string> faint;
    double sum = 0;
    while (!m_setup.lights.empty()) {
      std::size_t least = 0;
      for (std::size_t i = 1; i < m_lamps.size(); ++i)
        if (adds(m_lamps[i]) < adds(m_lamps[least])) least = i;
      const std::optional<double> bound = afford(adds(m_lamps[least]));
      if (!bound) break;
      sum += *bound;
      faint.push_back(fmt::format("'{}'", m_setup.lights[least]->name()));
      dropLamp(least);
    }
    if (faint.empty()) return;
    lamps.on = !m_setup.lights.empty();
    lamps.bound = sum;
    lamps.why = fmt::format("{} of {} shine on the smoke; without {}, {}", m_setup.lights.size(),
                            m_allLamps, fmt::join(faint, ", "), share(sum));
  }

  // Why no lamp's light is scattered toward the eye; empty where it is.
  std::string dark() const {
    if (!(m_setup.medium->majorants().maximum() > 0)) return "there is no smoke";
    if (!m_scatters) return "the smoke only absorbs (albedo 0)";
    if (!m_setup.lights.empty()) return "";
    return m_allLamps > 0 ? "no light shines on the smoke" : "there is no light";
  }

  Decision singleScattering() {
    return unlessNever("single_scattering", dark(), "lights reach smoke that scatters");
  }

  Decision multipleScattering() {
    const bool lit = glows() && !isOff("emission") && m_scatters;
    if (m_single && !isOff("multiple_scattering")) return {false, "estimator.type is single"};
    Decision decision =
        unlessNever("multiple_scattering", lit ? "" : dark(),
                    m_setup.lights.empty() ? "smoke scatters the light that it gives off"
                                           : "lights reach smoke that scatters");
    if (!decision.on || isOn("multiple_scattering") || m_forOtherViews) return decision;
    double most = lit ? m_bounds->scatteredGlow() : 0.0;
    for (const LampBound& lamp : m_lamps)
      most += lamp.multiple;
    if (const std::optional<double> bound = afford(most))
      return {false, "the smoke is thin: light scattered twice or more is " + share(*bound), bound};
    return decision;
  }

  Decision emission() {
    Decision decision = unlessNever("emission", glows() ? "" : darkEmission(), "a volume emits");
    if (!decision.on || !glows() || isOn("emission") || m_forOtherViews) return decision;
    const std::optional<double> bound =
        afford(m_bounds->glow() + (m_multiple ? m_bounds->scatteredGlow() : 0.0));
    if (!bound) return decision;
    const transport::Shutter shutter = m_setup.medium->shutter();
    // Nothing is left that births photons or fills bricks.
    std::vector<transport::MediumVolume> volumes = std::move(*m_setup.medium).takeVolumes();
    for (transport::MediumVolume& volume : volumes)
      volume.emission = {};
    m_setup.medium = std::make_unique<transport::Medium>(std::move(volumes), shutter);
    return {false, "the smoke's glow is " + share(*bound), bound};
  }
  std::string darkEmission() const {
    if (m_glowed) return "what emits is left out";
    for (const VolumeEntry& volume : m_scene.volumes)
      if (volume.emits) return "the emission is zero everywhere";
    return "no volume emits";
  }

  Decision shadows() {
    Decision decision = unlessNever("shadows", dark(), "smoke casts shadows on itself");
    if (!decision.on || isOn("shadows")) return decision;
    double most = 0;
    for (const LampBound& lamp : m_lamps)
      most += lamp.single * lamp.shadow;
    if (const std::optional<double> bound = afford(most))
      return {false, "the smoke is thin: its shadows take away " + share(*bound), bound};
    return decision;
  }

  // Off where smoke and camera move light by less than shows, as depth of field is.
  Decision motionBlur() {
    if (isOff("motion_blur")) return {false, "off in the scene"};
    const transport::Medium& medium = *m_setup.medium;
    if (!medium.isMoving() && !m_setup.motion)
      return {false, "no volume has a velocity, and the camera stands still", 0.0};
    double pixels = 0;
    if (medium.isMoving())
      pixels +=
          medium.displacement() / m_setup.space.metersPerUnit * pixelsPerUnit(m_scene, m_setup);
    if (m_setup.motion) pixels += m_setup.motion->blur(m_setup.worldBounds);
    const std::string why = fmt::format("the {} by up to {:.2g} pixels while the shutter is open",
                                        !m_setup.motion      ? "smoke moves"
                                        : !medium.isMoving() ? "camera moves the smoke"
                                                             : "smoke and the camera move it",
                                        pixels);
    if (isOn("motion_blur") || m_forOtherViews) return {true, why};
    const std::optional<double> bound = affordShift(pixels);
    if (!bound) return {true, why};
    if (medium.isMoving()) *m_setup.medium = std::move(*m_setup.medium).held();
    m_setup.motion.reset();
    return {false, fmt::format("{}, {}", why, share(*bound)), bound};
  }
  // The same for light that is seen up to so many pixels from where it would be: the picture
  // differs there by no more than its steepest step times that way along either axis.
  std::optional<double> affordShift(double pixels) {
    if (!m_bounds || !(m_tolerance > m_spent)) return std::nullopt;
    const double mean = picture().meanRadiance;
    const double bound = kSafety * std::sqrt(2.0) * pixels * picture().steepest / mean;
    if (!(mean > 0) || !(bound <= m_tolerance - m_spent)) return std::nullopt;
    m_spent += bound;
    return bound;
  }

  // Why there is no lens; otherwise it is on, and the frame has it.
  Decision prepareLens() {
    const double fstop = m_scene.camera.real("fstop");
    if (isOff("depth_of_field")) return {false, "off in the scene"};
    if (!(fstop > 0)) return {false, "the camera is a pinhole", 0.0};
    if (m_scene.cameraType != "perspective")
      return {false, "only a perspective camera has a lens", 0.0};
    m_setup.lens = lensOf(m_scene, m_setup);
    return {true, fmt::format("the lens blurs the smoke over up to {:.2g} pixels",
                              widestBlur(m_scene, m_setup))};
  }

  // A pixel is the mean of what lies within half of the widest blur.
  void depthOfField(Decision& lens) {
    if (lens.on && !isOn("depth_of_field"))
      if (const std::optional<double> bound = affordShift(0.5 * widestBlur(m_scene, m_setup)))
        lens = {false, fmt::format("{}, {}", lens.why, share(*bound)), bound};
    m_setup.effects.depthOfField = lens.on;
    if (!lens.on) m_setup.lens = {};
  }
  void chromatic() {
    std::string coloured = m_setup.medium->isColoured() ? "extinction is coloured"
                           : m_setup.medium->isGrey()   ? ""
                                                        : "an albedo is coloured";
    const transport::Emission* emission = m_setup.medium->emission();
    if (emission && !emission->isGrey()) coloured = "the emission is coloured";
    for (const auto& light : m_setup.lights)
      if (!light->isGrey()) coloured = fmt::format("light '{}' is coloured", light->name());
    if (isOff("chromatic") && !coloured.empty())
      throw ConfigError(
          fmt::format("[effects]: chromatic = \"off\", but {}; one channel cannot "
                      "hold that, so make it grey or leave chromatic at auto",
                      coloured));
    const Decision decision = unlessNever(
        "chromatic", coloured.empty() ? "lights, extinction, albedos and emission are grey" : "",
        coloured);
    m_setup.effects.chromatic = decision.on;
    note("chromatic", decision);
  }

  void directions() {
    const bool even = scattersEvenly(*m_setup.medium);
    note("directions", even ? Decision{false, "every phase function is isotropic", 0.0}
                            : Decision{true, "a phase function depends on the direction"});
  }

  const SceneFile& m_scene;
  FrameSetup& m_setup;
  double m_tolerance;
  double m_spent = 0;    // of the tolerance
  bool m_forOtherViews;  // the light is kept for cameras that are not known
  bool m_single;         // light scattered twice is nobody's to estimate
  bool m_scatters = false;
  bool m_multiple = true;
  bool m_glowed = false;  // before volumes were left out
  std::size_t m_allLamps = 0;
  std::optional<LightBounds> m_bounds;  // nothing without smoke
  std::vector<LampBound> m_lamps;       // as m_setup.lights
  std::optional<PreRender> m_picture;
  Decision m_environment;
};

}  // namespace

bool scattersEvenly(const transport::Medium& medium) {
  for (const phase::PhaseFunction& phase : medium.phases())
    for (int i = 0; i < phase.lobes(); ++i)
      if (phase.lobe(i).g() != 0.0 || phase.lobe(i).alpha() != 0.0) return false;
  return true;
}

void planEffects(const SceneFile& scene, bool forOtherViews, FrameSetup& setup) {
  EffectPlan(scene, forOtherViews, setup).decide();
}

}  // namespace photosphere::scene
