#include "pre_render.h"

#include <algorithm>
#include <cmath>

#include "photosphere/core/parallel.h"
#include "photosphere/render/integrator.h"
#include "photosphere/render/shadows.h"

namespace photosphere::scene {

namespace {

constexpr int kAcross = 32;
// March steps over the smoke's diagonal, unless its voxels are wider.
constexpr double kSteps = 96;
// A pixel shows smoke where it has this part of the opacity, or of the glow, of the one with most:
// solvers leave traces of 1e-30 all over their domain (volume::kTraceDepth).
constexpr float kTrace = 0.01f;

// A pixel and its neighbours to the right and below.
struct Probe {
  render::RayRadiance here, right, below;
};

double difference(const render::RayRadiance& a, const render::RayRadiance& b) {
  const Rgb d = glm::abs(a.total() - b.total());
  return static_cast<double>(maxComponent(d));
}

}  // namespace

PreRender preRender(const FrameSetup& setup, const Effects& effects) {
  const transport::Medium& medium = *setup.medium;
  const double diagonal = glm::length(medium.bounds().extent());
  render::MarchOptions options;
  options.effects = effects;
  options.step = static_cast<float>(std::max(1.0, diagonal / kSteps / medium.voxelEdge()));
  const render::Shadows shadows(medium, setup.lights, render::ShadowMode::march,
                                options.step * static_cast<float>(medium.voxelEdge()), 0);
  const auto integrator =
      render::makeMarchIntegrator(medium, setup.lights, shadows, nullptr, options);

  const Vec2d size(setup.camera->resolution());
  const int down = std::clamp(static_cast<int>(std::lround(kAcross * size.y / size.x)), 1, kAcross);
  std::vector<Probe> probes(static_cast<std::size_t>(kAcross * down));
  parallelFor(probes.size(), 8, [&](std::size_t begin, std::size_t end) {
    render::IntegratorCounters counters;
    for (std::size_t i = begin; i < end; ++i) {
      const Vec2d at = (Vec2d(static_cast<int>(i) % kAcross, static_cast<int>(i) / kAcross) + 0.5) /
                       Vec2d(kAcross, down) * size;
      // Neighbours share their random numbers: what differs is the smoke.
      const auto radiance = [&](const Vec2d& raster) {
        Rng rng(RandomKey{}, RandomStream::camera, std::uint64_t{0xfffffe} << 40 | i);
        const cameras::CameraRay ray = setup.camera->ray(raster);
        return integrator->radiance(setup.space.localFromWorld(ray.origin), Vec3f(ray.direction),
                                    transport::Moment{}, rng, counters);
      };
      probes[i] = {radiance(at), radiance(at + Vec2d(1, 0)), radiance(at + Vec2d(0, 1))};
    }
  });

  float opaque = 0, glowing = 0;
  const auto opacity = [](const Probe& p) { return p.here.opacity; };
  for (const Probe& p : probes) {
    opaque = std::max(opaque, opacity(p));
    glowing = std::max(glowing, meanComponent(p.here.emission));
  }
  PreRender result;
  double sum = 0, count = 0;
  for (const Probe& p : probes) {
    result.steepest =
        std::max({result.steepest, difference(p.here, p.right), difference(p.here, p.below)});
    if (!(opacity(p) > kTrace * opaque) && !(meanComponent(p.here.emission) > kTrace * glowing))
      continue;
    sum += static_cast<double>(meanComponent(p.here.total()));
    count += 1;
  }
  if (count > 0) result.meanRadiance = sum / count;
  return result;
}

}  // namespace photosphere::scene
