#include "light_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "effect_plan.h"
#include "estimator_options.h"
#include "light_notes.h"
#include "light_voxels.h"
#include "photosphere/cameras/moving_camera.h"
#include "photosphere/volume/rasterize.h"

namespace photosphere::scene {

namespace {

// Nearest-neighbour spacing of the carriers [m].
double carrierSpacing(const std::vector<Vec3f>& particles) {
  volume::ParticleSet set;
  set.positions.assign(particles.begin(), particles.end());
  return set.size() > 1 ? volume::medianSpacing(set) : 0.0;
}

// |g| of the sharpest lobe from where on a photon that happens to fly toward the eye counts so much
// alone that it leaves a bright block: its direction is smoothed by a kernel of that width, or kept
// in that many bins, of which fewer are dark there (README.md, bases of directions).
constexpr double kSharpLobe = 0.85;
constexpr double kSharpBandwidth = 0.2;  // [rad], epanechnikov
constexpr int kSharpRows = 4;

// Where the choice is the tool's: what a light cache holds was chosen when it was traced.
bool smoothsSharpLobes(const ParamValues& e, double sharpest) {
  return e.text("basis") == "auto" && e.text("type") == "photosphere" && e.text("cache").empty() &&
         sharpest >= kSharpLobe;
}

void heedSharpLobes(const ParamValues& e, double sharpest, FrameSetup& setup) {
  using namespace estimators;
  LightFieldLayout& l = setup.layout;
  std::string how;
  if (l.basis == Basis::view && !e.given("kernel")) {
    l.angularKernel = sphere::AngularKernel::epanechnikov;
    l.bandwidth = kSharpBandwidth;
    how = fmt::format("directions are smoothed over {} rad (estimator.kernel)", l.bandwidth);
  } else if (l.basis == Basis::histogram && !e.given("rows")) {
    how = fmt::format("light is stored in {} bins of direction (estimator.rows)", l.bins());
  }
  if (!how.empty())
    setup.notes.push_back(
        fmt::format("a phase function has a lobe of g = {:.3g}: {}", sharpest, how));
}

// Angle under which smoke sees the eye move from where it is in the middle of the shutter, up to
// which light for that one eye serves [rad].
constexpr double kSmallParallax = 0.1;

// Angle under which the nearest smoke sees the lens from its middle to its edge. Around an eye in
// smoke that is what lies a light voxel away.
double lensParallax(const FrameSetup& setup) {
  if (!(setup.lens.radius > 0) || setup.worldBounds.empty()) return 0.0;
  const Vec3d eye = cameras::placementOf(*setup.camera).eye;
  const Vec3d nearest = setup.worldBounds.nearest(eye);
  const double voxel =
      setup.layout.lightVoxel * setup.medium->voxelEdge() / setup.space.metersPerUnit;
  return std::atan2(setup.lens.radius, glm::length(eye - nearest) + voxel);
}

// Light is looked up toward the eye of the ray where it is stored for all directions, unless the
// scene says otherwise.
void heedParallax(const SceneFile& scene, bool forLightCache, FrameSetup& setup) {
  if (forLightCache) return;  // which any camera may read
  using namespace estimators;
  const ParamValues& e = scene.estimator;
  LightFieldLayout& l = setup.layout;
  const double moving = setup.motion ? setup.motion->parallax(setup.worldBounds) : 0.0;
  const double lens = lensParallax(setup);
  if (e.text("type") != "photosphere" || l.evaluate != Evaluate::perView ||
      std::max(moving, lens) <= kSmallParallax)
    return;
  const bool free = e.text("basis") == "auto" || l.basis != Basis::view;
  const bool smoothing = e.given("smoothing") && l.smoothing != Smoothing::twicing &&
                         l.smoothing != Smoothing::visible;
  const bool chosen = free && !e.given("evaluate") && !smoothing;
  if (chosen) {
    if (l.basis == Basis::view) l.basis = Basis::histogram;
    l.evaluate = Evaluate::perStep;
  }
  const std::string seen = moving > lens
                               ? fmt::format(
                                     "while the shutter is open the smoke sees the camera move by "
                                     "{:.2g} degrees",
                                     2 * moving * 180 / kPi)
                               : fmt::format("the nearest smoke sees the lens under {:.2g} degrees",
                                             2 * lens * 180 / kPi);
  setup.notes.push_back(fmt::format(
      "{}: light is {}", seen,
      chosen
          ? fmt::format("stored in {} bins of direction and looked up toward the eye of each ray "
                        "(estimator.evaluate = \"per_step\")",
                        l.bins())
          : "that toward the eye in the middle; estimator.basis = \"histogram\" with evaluate = "
            "\"per_step\" serves all"));
}

// Light voxels from the eye up to which directions are looked up toward the eye of each ray where
// smoke scatters unevenly. Light scattered more than once around an eye in smoke of g = 0.8, over
// that with all of it looked up so: 0.61 at 0, 0.98 at 1, 1.00 at 2 in a column; 0.70, 0.96, 0.99
// and 1.00 at 4 in a wide plume.
constexpr double kNearVoxels = 3;

constexpr double kHalfDiagonal = 0.8661;  // of a cube of edge 1, and a little

// The radius that the scene states, or one that suits the smoke, within what light voxels can hold.
void chooseRadius(const ParamValues& e, FrameSetup& setup) {
  using namespace estimators;
  LightFieldLayout& l = setup.layout;
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
  // Particles are read by way of light voxels: one whose kernel meets the centre of none would lose
  // its light.
  const double narrowest = kHalfDiagonal * l.lightVoxel * setup.medium->voxelEdge();
  if (l.carrier == Carrier::particles && l.radius < narrowest) {
    if (e.real("radius") > 0)
      setup.notes.push_back(fmt::format(
          "estimator.radius = {:.4g} is less than light voxels are apart; their half diagonal, "
          "{:.4g}, is taken (lower estimator.light_voxel for less)",
          e.real("radius"), narrowest / setup.space.metersPerUnit));
    l.radius = narrowest;
  }
  const Vec3d extent = setup.medium->bounds().extent();
  const double across = std::max({extent.x, extent.y, extent.z});
  if (e.real("radius") > 0 && !setup.medium->bounds().empty() && l.radius > across &&
      (l.carrier == Carrier::particles || e.text("type") == "photon_map"))
    setup.notes.push_back(fmt::format(
        "estimator.radius = {:.4g} is wider than the smoke, {:.4g}: light scattered many times is "
        "spread far over its edge (0 chooses a radius)",
        e.real("radius"), across / setup.space.metersPerUnit));
  const double widest = kMostVoxelsWide * l.lightVoxel * setup.medium->voxelEdge();
  if (e.text("type") == "photosphere" && !l.holdsPower() && l.radius > widest) {
    setup.notes.push_back(
        fmt::format("estimator.radius = {:.4g} spans {:.3g} light voxels; {} are the most that "
                    "light is smoothed over, {:.4g} (raise estimator.light_voxel for more)",
                    e.real("radius"), l.radius / (l.lightVoxel * setup.medium->voxelEdge()),
                    kMostVoxelsWide, widest / setup.space.metersPerUnit));
    l.radius = widest;
  }
  const double deposit = e.real("deposit_radius") * setup.space.metersPerUnit;
  l.depositRadius = deposit > 0 ? deposit : l.radius;
}

}  // namespace

void chooseLayout(const SceneFile& scene, bool forLightCache, FrameSetup& setup) {
  using namespace estimators;
  const ParamValues& e = scene.estimator;
  LightFieldLayout& l = setup.layout;
  const bool cached = forLightCache || !e.text("cache").empty();
  l = layoutOf(e, cached);
  const double sharpest = sharpestLobe(*setup.medium);
  const bool sharp = smoothsSharpLobes(e, sharpest);
  if (sharp && !e.given("rows")) l.rows = kSharpRows;  // should it come to bins
  // Light without directions serves every eye.
  const bool even = scattersEvenly(*setup.medium);
  if (!even) heedParallax(scene, forLightCache, setup);
  if (sharp) heedSharpLobes(e, sharpest, setup);
  // Bins would all be read alike: one coefficient holds what counts.
  const bool ofBins = l.direction != sphere::DirectionDeposit::nearest ||
                      l.representative != Representative::bin || l.merge != Merge::full ||
                      l.angularKernel != sphere::AngularKernel::none;
  if (e.text("basis") == "auto" && l.basis == Basis::histogram && !ofBins && even) {
    l.basis = Basis::sphericalHarmonics;
    l.order = 0;
  }
  l.channels = setup.effects.chromatic ? 3 : 1;
  l.phases = static_cast<int>(setup.medium->phases().size());
  for (const auto& light : setup.lights)
    l.unscattered = l.unscattered || (!light->isDelta() && setup.effects.singleScattering);
  chooseSmoothing(e, setup);
  chooseLightVoxel(e, setup);
  chooseRadius(e, setup);
  // Last: how light is stored elsewhere must not depend on where the eye is.
  if (!forLightCache && !even && setup.view.hasEye && l.evaluate == Evaluate::perView)
    l.nearEye = kNearVoxels;
}

}  // namespace photosphere::scene
