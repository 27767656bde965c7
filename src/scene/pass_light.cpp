#include "pass_light.h"

#include <fmt/format.h>

#include <algorithm>

#include "estimator_options.h"
#include "light_stage.h"
#include "photon_map_stage.h"
#include "photosphere/core/resources.h"

namespace photosphere::scene {

namespace {

// A basis that can go negative rings beside sharp peaks.
void noteNegative(double share, FrameSetup& setup, FrameStatistics& statistics) {
  statistics.negativeLight = share;
  if (!(share > 0.001)) return;
  setup.notes.push_back(fmt::format(
      "{:.2g} of the stored light is below zero toward where it is read: the basis rings beside "
      "sharp peaks; raise estimator.{}",
      share,
      setup.layout.basis == estimators::Basis::sphericalHarmonics
          ? "order, or smooth with estimator.kernel"
          : "rows"));
}

std::string describe(const estimators::PhotonMapLayout& map) {
  return fmt::format("photon map, {} channel{}, {}{}", map.channels, map.channels == 1 ? "" : "s",
                     map.neighbors > 0 ? fmt::format("{} nearest", map.neighbors) : "all in reach",
                     map.passes > 1 ? fmt::format(", {} passes", map.passes) : "");
}

PassLight::Source widened(const FrameSetup& setup, estimators::LightField field) {
  // A kernel narrower than a light voxel does nothing: the voxel itself is the width there.
  const double edge = field.layout.lightVoxel * setup.medium->voxelEdge();
  field.layout.radius = kWidening * std::max(field.layout.radius, edge);
  return estimators::resolve(*setup.medium, std::move(field), setup.view, setup.key);
}

}  // namespace

PassLight prepareLight(const SceneFile& scene, const RenderRequest& request, int batch, int pass,
                       bool wider, FrameSetup& setup, FrameResult& result) {
  PassLight light;
  if (!storesLight(scene, setup)) return light;
  if (setup.photonMap) {
    result.layout = describe(*setup.photonMap);
    result.radius = setup.photonMap->radius / setup.space.metersPerUnit;
    light.source = photonMapPass(setup, pass, 1.0, result.statistics);
    FrameStatistics again;
    if (wider) light.wider = photonMapPass(setup, pass, kWidening, again);
    return light;
  }
  estimators::LightField field =
      lightField(scene, request, setup, result.statistics, static_cast<std::uint64_t>(batch));
  result.layout = describeLayout(setup.layout);
  result.radius = setup.layout.radius / setup.space.metersPerUnit;
  const Stopwatch watch;
  if (wider) light.wider = widened(setup, field);
  auto source = estimators::resolve(*setup.medium, std::move(field), setup.view, setup.key);
  result.statistics.seconds.resolve += watch.seconds();
  noteNegative(source->negativeShare(), setup, result.statistics);
  light.source = std::move(source);
  return light;
}

}  // namespace photosphere::scene
