#include "photosphere/scene/frame_setup.h"

#include <fmt/format.h>

#include <cmath>

#include "camera_setup.h"
#include "estimator_options.h"
#include "photon_map_stage.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/registry.h"
#include "photosphere/core/resources.h"
#include "photosphere/phase/phase.h"
#include "photosphere/volume/rasterize.h"
#include "photosphere/volume/vdb_file.h"
#include "photosphere/volume/velocity.h"
#include "smoke_source.h"
#include "volume_emission.h"

namespace photosphere::scene {

namespace {

// Independent parts of a frame whose error is estimated: the relative standard error of a variance
// from eight is about a half, but the mean of it over pixels is far better.
constexpr int kErrorBatches = 8;
// Voxels that a velocity is carried on beyond those that the cache has.
constexpr double kMostMargin = 48;

Mat4d localFromWorld(const lights::LocalSpace& space) {
  Mat4d m(space.metersPerUnit);
  m[3] = glm::dvec4(-space.center * space.metersPerUnit, 1.0);
  return m;
}

Mat4d nodeShift(const Vec3i& origin) {
  Mat4d m(1.0);
  m[3] = glm::dvec4(Vec3d(origin), 1.0);
  return m;
}

std::uint64_t memoryBudget(const SceneFile& scene) {
  const double limit = scene.render.real("memory_limit");
  if (limit < 0) return 0;
  const double bytes = limit > 0 ? limit * 1024.0 * 1024.0 * 1024.0
                                 : 0.85 * static_cast<double>(availableMemoryBytes());
  return static_cast<std::uint64_t>(std::max(1.0, std::min(bytes, 9e18)));
}

// Largest of [r, g, b].
double largestScale(const VolumeEntry& entry) {
  return maxComponent(entry.values.vec3("density_scale"));
}

// The densest channel's, and what the others have of it.
void setExtinction(const VolumeEntry& entry, transport::MediumVolume& placed) {
  placed.densityScale = largestScale(entry);
  if (placed.densityScale > 0)
    placed.tint = Rgb(entry.values.vec3("density_scale") / placed.densityScale);
}

// Velocity in local space, wide enough for all that moves while the shutter is open.
transport::VolumeMotion placeMotion(const VolumeSource& source, const lights::LocalSpace& space,
                                    const transport::Shutter& shutter, std::uint64_t budget) {
  transport::VolumeMotion motion;
  if (!source.velocity || !(shutter.longest() > 0)) return motion;
  const Mat3d linear(localFromWorld(space) * source.worldFromFile);
  const Mat4d localFromIndex = localFromWorld(space) * source.worldFromIndex(source.velocity);
  const double raw = volume::statistics(source.velocity).max;
  const double longest =
      std::max({glm::length(linear[0]), glm::length(linear[1]), glm::length(linear[2])});
  const double voxels = raw * longest * shutter.longest() / volume::finestSpacing(localFromIndex);
  const int margin = static_cast<int>(std::min(std::ceil(voxels) + 1, kMostMargin));
  const volume::Grid grid =
      volume::velocityForLookups(source.velocity, linear, margin, source.path);
  motion.velocity = volume::vectorBricksFromGrid(grid, source.path, budget);
  motion.localFromNode = localFromIndex * nodeShift(motion.velocity.origin());
  volume::forEachNode(motion.velocity, [&](const Vec4f& v) {
    motion.fastest = std::max(motion.fastest, glm::length(Vec3d(v)));
  });
  return motion;
}

transport::MediumVolume placeVolume(const VolumeEntry& entry, const VolumeSource& source,
                                    const lights::LocalSpace& space, std::uint64_t budget) {
  transport::MediumVolume placed;
  if (!source.density) return placed;
  placed.name = source.density.name();
  placed.density = volume::bricksFromGrid(source.density, 0, source.path, false, budget);
  placed.localFromNode = localFromWorld(space) * source.worldFromIndex(source.density) *
                         nodeShift(placed.density.origin());
  setExtinction(entry, placed);
  placed.albedo = entry.values.rgb("albedo");
  if (source.albedo) {
    const int components = source.albedo.kind() == volume::GridKind::vector ? 3 : 1;
    for (int c = 0; c < components; ++c)
      placed.albedoFields.push_back(
          volume::bricksFromGrid(source.albedo, c, source.path, false, budget));
    placed.localFromAlbedoNode = localFromWorld(space) * source.worldFromIndex(source.albedo) *
                                 nodeShift(placed.albedoFields.front().origin());
  }
  placed.phase = findPlugin(phase::phaseFunctions(), entry.phase, "phase", entry.where)
                     .create(entry.phaseValues);
  return placed;
}

// True when something in the source can be seen at this density scale.
bool visible(const VolumeSource& source, double densityScale) {
  const bool smoke = source.density && !source.density.activeBounds().empty() && densityScale > 0;
  return smoke || (source.emission && !source.emission.activeBounds().empty());
}

// Keyed values as they are at the frame, and the resolution that is asked for.
SceneFile sceneOfFrame(const SceneFile& written, std::int64_t frame, const SetupOptions& options) {
  SceneFile scene = written;
  if (options.resolution)
    scene.camera.set("resolution",
                     std::vector<double>{static_cast<double>(options.resolution->x),
                                         static_cast<double>(options.resolution->y)},
                     scene.cameraWhere);
  scene = sceneAt(scene, static_cast<double>(frame));
  const Vec2d shutter = scene.camera.vec2("shutter");
  if (shutter.y < shutter.x)
    throw ConfigError(fmt::format("{}: 'shutter' closes at {}, before it opens at {}",
                                  scene.cameraWhere, shutter.y, shutter.x));
  return scene;
}

// Two passes: where the smoke is, then the smoke about its own centre.
void buildMedium(const SceneFile& scene, std::int64_t cacheFrame, bool wantParticles,
                 FrameSetup& setup) {
  std::vector<VolumeSource> sources;
  const bool glows = scene.effects.text("emission") != "off";
  const bool moves = scene.effects.text("motion_blur") != "off";
  for (const VolumeEntry& entry : scene.volumes) {
    sources.push_back(readVolume(scene, entry, cacheFrame, {wantParticles, glows, moves}));
    setup.readSeconds += sources.back().readSeconds;
    setup.rasterizeSeconds += sources.back().rasterizeSeconds;
    setup.worldBounds.grow(sources.back().bounds());
    for (const std::string& note : sources.back().notes)
      setup.notes.push_back(note);
  }
  setup.space.metersPerUnit = scene.scene.real("meters_per_unit");
  if (!setup.worldBounds.empty()) setup.space.center = setup.worldBounds.center();

  const Stopwatch watch;
  const Vec2d frames = scene.camera.vec2("shutter") / scene.scene.real("fps");
  const transport::Shutter shutter{frames.x, frames.y};
  std::vector<transport::MediumVolume> placed;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    for (const Vec3d& p : sources[i].particles)
      setup.particles.emplace_back(setup.space.localFromWorld(p));
    if (!visible(sources[i], largestScale(scene.volumes[i]))) {
      setup.notes.push_back(fmt::format("{}: no smoke in it at this frame", sources[i].path));
      continue;
    }
    placed.push_back(placeVolume(scene.volumes[i], sources[i], setup.space, setup.memoryBudget));
    if (sources[i].emission)
      placed.back().emission =
          placeEmission(scene.volumes[i], sources[i], localFromWorld(setup.space),
                        scene.output.text("colorspace"), setup.memoryBudget, setup.notes);
    placed.back().motion = placeMotion(sources[i], setup.space, shutter, setup.memoryBudget);
    if (placed.back().density.empty() && placed.back().emission.field.empty()) placed.pop_back();
  }
  setup.medium = std::make_unique<transport::Medium>(std::move(placed), shutter);
  // Active voxels may hold zeros: what frames the smoke is the box of what scatters or emits.
  setup.worldBounds = Box3d();
  if (const Box3d& local = setup.medium->bounds(); !local.empty()) {
    setup.worldBounds.grow(setup.space.worldFromLocal(local.min));
    setup.worldBounds.grow(setup.space.worldFromLocal(local.max));
  }
  setup.readSeconds += watch.seconds();
}

void buildLights(const SceneFile& scene, FrameSetup& setup) {
  for (const LightEntry& entry : scene.lights) {
    if (entry.type == "environment" && scene.effects.text("environment") == "off") continue;
    const lights::LightPlugin& plugin =
        findPlugin(lights::lightModels(), entry.type, "light type", entry.where);
    try {
      ParamValues values = entry.values;
      if (values.given("file"))
        values.set("file", scene.resolvePath(values.text("file")), entry.where);
      setup.lights.push_back(plugin.create(values, setup.space));
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("{}: {}", entry.where, error.what()));
    }
    setup.lights.back()->setName(entry.values.text("name"));
  }
}

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
    motionBlur();
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
  // Off where nothing moves farther than a pixel filter sees.
  void motionBlur() {
    bool& on = m_setup.effects.motionBlur;
    on = false;
    const std::string& wish = m_scene.effects.text("motion_blur");
    if (wish == "off") {
      note("motion_blur", false, "off in the scene");
    } else if (!m_setup.medium->isMoving() && !m_setup.motion) {
      note("motion_blur", false, "no volume has a velocity, and the camera stands still");
    } else {
      const double smoke = m_setup.medium->isMoving() ? smokeBlur() : 0.0;
      const double camera = m_setup.motion ? m_setup.motion->blur(m_setup.worldBounds) : 0.0;
      on = wish == "on" || smoke + camera > kUnseenBlur;
      note("motion_blur", on,
           fmt::format("the {} by up to {:.2g} pixels while the shutter is open",
                       !m_setup.motion               ? "smoke moves"
                       : !m_setup.medium->isMoving() ? "camera moves the smoke"
                                                     : "smoke and the camera move it",
                       smoke + camera));
      if (on) return;
      if (m_setup.medium->isMoving()) *m_setup.medium = std::move(*m_setup.medium).held();
      m_setup.motion.reset();
    }
  }
  // Farthest way of the fastest smoke, seen from as near as any smoke is [pixels].
  double smokeBlur() const {
    const transport::Medium& medium = *m_setup.medium;
    const transport::Shutter& shutter = medium.shutter();
    const double way = medium.displacement() / shutter.longest() * (shutter.close - shutter.open) /
                       m_setup.space.metersPerUnit;
    return way * pixelsPerUnit();
  }
  // Of the nearest smoke, in any direction [pixels per scene unit].
  double pixelsPerUnit() const {
    const cameras::Camera& camera = *m_setup.camera;
    const double width = camera.resolution().x;
    const Box3d& box = m_setup.worldBounds;
    if (!camera.hasEye())
      return 1 / glm::length(camera.ray({1, 0}).origin - camera.ray({0, 0}).origin);
    const Vec3d nearest = glm::clamp(camera.position(), box.min, box.max);
    const double distance = std::max(glm::length(nearest - camera.position()), 1e-9);
    return camera.isPanorama()
               ? width / (2 * kPi * distance)
               : width / (2 * std::tan(horizontalFov(m_scene.camera) * kPi / 360) * distance);
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
    std::string coloured = m_setup.medium->isColoured() ? "extinction is coloured"
                           : m_setup.medium->isGrey()   ? ""
                                                        : "an albedo is coloured";
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
                            coloured.empty() ? "lights, extinction, albedos and emission are grey"
                                             : coloured);
  }

  const SceneFile& m_scene;
  FrameSetup& m_setup;
};

// Nearest-neighbour spacing of the carriers [m].
double carrierSpacing(const std::vector<Vec3f>& particles) {
  volume::ParticleSet set;
  set.positions.assign(particles.begin(), particles.end());
  return set.size() > 1 ? volume::medianSpacing(set) : 0.0;
}

// Mean cosine of the sharpest lobe, and from where on bins have less error than the view basis
// (README.md, bases of directions): a photon that happens to fly toward the eye counts alone there,
// and leaves a bright block.
constexpr double kSharpLobe = 0.85;
constexpr int kSharpRows = 4;  // fewer bins than 128 are dark there

double sharpestLobe(const transport::Medium& medium) {
  double sharpest = 0;
  for (const phase::PhaseFunction& phase : medium.phases())
    for (int i = 0; i < phase.lobes(); ++i)
      sharpest = std::max(sharpest, std::abs(phase.lobe(i).g()));
  return sharpest;
}

// Angle under which smoke sees the eye move from where it is in the middle of the shutter, up to
// which light for that one eye serves [rad].
constexpr double kSmallParallax = 0.1;

void heedParallax(const SceneFile& scene, FrameSetup& setup) {
  estimators::LightFieldLayout& l = setup.layout;
  const double parallax = setup.motion ? setup.motion->parallax(setup.worldBounds) : 0.0;
  if (scene.estimator.text("type") != "photosphere" || l.basis != estimators::Basis::view ||
      parallax <= kSmallParallax)
    return;
  const bool chosen = scene.estimator.text("basis") == "auto";
  if (chosen) l.basis = estimators::Basis::histogram;
  setup.notes.push_back(fmt::format(
      "while the shutter is open the smoke sees the camera move by {:.2g} degrees: light is {}",
      2 * parallax * 180 / kPi,
      chosen ? fmt::format("stored in {} bins of direction, which serve every eye", l.bins())
             : "stored for the eye in the middle; estimator.basis = \"histogram\" serves all"));
}

void buildLayout(const SceneFile& scene, const SetupOptions& options, FrameSetup& setup) {
  using namespace estimators;
  const ParamValues& e = scene.estimator;
  LightFieldLayout& l = setup.layout;
  const bool cached = options.forLightCache || !e.text("cache").empty();
  l = layoutOf(e, cached);
  if (const double g = sharpestLobe(*setup.medium);
      e.text("basis") == "auto" && l.basis == Basis::view && g >= kSharpLobe) {
    l.basis = Basis::histogram;
    if (!e.given("rows")) l.rows = kSharpRows;
    if (e.text("type") == "photosphere")
      setup.notes.push_back(
          fmt::format("a phase function has a lobe of g = {:.3g}: light is stored in {} bins of "
                      "direction, as estimator.basis = \"view\" would be noisier",
                      g, l.bins()));
  }
  heedParallax(scene, setup);
  l.channels = setup.effects.chromatic ? 3 : 1;
  l.phases = static_cast<int>(setup.medium->phases().size());
  for (const auto& light : setup.lights)
    l.unscattered = l.unscattered || (!light->isDelta() && setup.effects.singleScattering);
  l.radius = e.real("radius") * setup.space.metersPerUnit;
  if (!(l.radius > 0)) {
    l.radius = automaticRadius(*setup.medium, l, static_cast<std::uint64_t>(e.integer("photons")));
    if (l.carrier == Carrier::particles) {
      // About 20 particles where they fill space evenly: a ball of 3 spacings. Power is smoothed
      // with the smoke it was left in, so it takes no more than that: what a wider radius blurs
      // over the smoke's edge soon exceeds the noise that it removes (README.md).
      const double spacings = 3.0 * carrierSpacing(setup.particles);
      l.radius = l.holdsPower() && spacings > 0 ? spacings : std::max(l.radius, spacings);
    }
  }
  const double deposit = e.real("deposit_radius") * setup.space.metersPerUnit;
  l.depositRadius = deposit > 0 ? deposit : l.radius;
}

}  // namespace

FrameSetup setUpFrame(const SceneFile& written, std::int64_t frame, const SetupOptions& options) {
  const SceneFile scene = sceneOfFrame(written, frame, options);
  FrameSetup setup;
  setup.frame = frame;
  setup.memoryBudget = memoryBudget(scene);
  const bool particles = scene.estimator.text("type") == "photosphere" &&
                         scene.estimator.text("carrier") == "particles";
  buildMedium(scene, options.cacheFrame.value_or(frame), particles, setup);
  buildLights(scene, setup);
  buildCamera(scene, setup);
  EffectPlan(scene, setup).decide();
  viewFromTheMiddle(setup);
  buildLayout(scene, options, setup);
  const std::int64_t seed = options.seed.value_or(scene.scene.integer("seed"));
  setup.key = RandomKey::fromSeed(static_cast<std::uint64_t>(seed),
                                  scene.scene.flag("seed_per_frame") ? frame : 0);
  if (scene.render.real("target_error") > 0 || scene.render.real("time_limit") > 0)
    setup.batches = kErrorBatches;
  const auto photons = static_cast<std::uint64_t>(scene.estimator.integer("photons"));
  const auto batches = static_cast<std::uint64_t>(setup.batches);
  setup.photons = (photons + batches - 1) / batches;
  planPhotonMap(scene, setup);
  return setup;
}

bool storesLight(const SceneFile& scene, const FrameSetup& setup) {
  const std::string& type = scene.estimator.text("type");
  return (type == "photosphere" || type == "photon_map") && setup.effects.multipleScattering;
}

std::uint64_t predictedLightBytes(const FrameSetup& setup) {
  if (setup.photonMap) return estimators::photonMapBytes(*setup.photonMap, setup.photonMapPhotons);
  const estimators::LightFieldLayout& l = setup.layout;
  const auto values = static_cast<std::uint64_t>(l.valuesPerCarrier());
  // Per step the floats are sharpened, which takes as many again.
  const bool perStep = l.evaluate == estimators::Evaluate::perStep;
  const std::uint64_t bytesEach = sizeof(std::int64_t) + sizeof(float) * (perStep ? 2 : 1);
  const transport::Medium& medium = *setup.medium;
  if (medium.bounds().empty()) return 0;
  std::uint64_t bytes = 0;
  if (l.carrier == estimators::Carrier::particles)
    bytes = setup.particles.size() * values * bytesEach;
  if (l.holdsPower()) return bytes;
  const double edge = l.lightVoxel * medium.voxelEdge();
  const int margin = static_cast<int>(std::ceil(l.radius / edge)) + 1;
  // A full box is an upper bound that costs nothing; only a large one is worth counting exactly.
  const Vec3d cells = glm::ceil(medium.bounds().extent() / edge) + 2.0 * margin + 8.0;
  const double perVoxel = static_cast<double>(values * bytesEach);
  const double most = cells.x * cells.y * cells.z * perVoxel;
  if (setup.memoryBudget == 0 || most < 0.5 * static_cast<double>(setup.memoryBudget))
    return bytes + static_cast<std::uint64_t>(most);
  return bytes + transport::SupportLattice(medium, edge, margin).size() * values * bytesEach;
}

void checkMemory(const FrameSetup& setup, bool storedLight) {
  if (setup.memoryBudget == 0) return;
  const std::uint64_t smoke = setup.medium->memoryBytes();
  const std::uint64_t light = storedLight ? predictedLightBytes(setup) : 0;
  const Vec2i size = setup.camera->resolution();
  const std::uint64_t frame =
      static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y) *
      (6 * sizeof(Rgb) + 2 * sizeof(float)) *
      (setup.batches > 1 || (setup.photonMap && setup.photonMap->passes > 1) ? 3 : 1);
  if (smoke + light + frame <= setup.memoryBudget) return;
  const std::string_view less =
      setup.photonMap
          ? "Lower estimator.photons (with estimator.passes, as many photons in less memory)"
          : "Raise estimator.light_voxel, lower estimator.rows (a histogram has 8 * rows^2 bins; "
            "basis = \"view\" has one)";
  throw MemoryError(fmt::format(
      "this frame needs about {}: {} for the smoke, {} for stored light, {} for pixels; the budget "
      "is {}. {}, lower the resolution, or raise render.memory_limit (-1 = none)",
      formatBytes(smoke + light + frame), formatBytes(smoke), formatBytes(light),
      formatBytes(frame), formatBytes(setup.memoryBudget), less));
}

}  // namespace photosphere::scene
