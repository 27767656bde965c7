#include "photon_map_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "light_stage.h"
#include "photosphere/core/resources.h"

namespace photosphere::scene {

namespace {

using estimators::PhotonMapLayout;

// Radius that the ball of the nearest photons keeps to where none is given [density voxels].
constexpr double kWidestBall = 8.0;

std::uint32_t neighbors(const ParamValues& e) {
  const std::int64_t nearest = e.integer("neighbors"), most = e.integer("max_photons");
  const std::int64_t both = nearest > 0 && most > 0 ? std::min(nearest, most) : nearest + most;
  return static_cast<std::uint32_t>(both);
}

// The whole progressive trace, of which pass i is the photons [i n, (i + 1) n).
transport::TraceOptions traceOptions(const FrameSetup& setup, int pass) {
  const std::uint64_t each = setup.photons;
  transport::TraceOptions options;
  options.photons = each * static_cast<std::uint64_t>(setup.photonMap->passes);
  options.firstPhoton = each * static_cast<std::uint64_t>(pass);
  options.photonCount = each;
  options.key = setup.key;
  options.guide = setup.guide.get();
  return options;
}

}  // namespace

void planPhotonMap(const SceneFile& scene, FrameSetup& setup) {
  const ParamValues& e = scene.estimator;
  if (e.text("type") != "photon_map" || !storesLight(scene, setup)) return;
  PhotonMapLayout& map = setup.photonMap.emplace();
  map.kernel = setup.layout.kernel;
  map.neighbors = neighbors(e);
  map.passes = static_cast<int>(e.integer("passes"));
  map.channels = setup.layout.channels;
  map.unscattered = setup.layout.unscattered;
  map.directionKernel = {setup.layout.angularKernel, setup.layout.bandwidth,
                         setup.layout.truncation};
  const estimators::PhotonForecast forecast = estimators::forecastPhotons(
      *setup.medium, setup.lights, map.unscattered, traceOptions(setup, 0));
  setup.photonMapPhotons = forecast.photons;
  estimators::PhotonForecast whole = forecast;  // of all batches, whose mean the frame is
  whole.photons *= static_cast<std::uint64_t>(setup.batches);
  map.radius = e.real("radius") * setup.space.metersPerUnit;
  if (map.radius > 0) {
    const double held = static_cast<double>(whole.photons) * 4.0 / 3.0 * kPi *
                        std::pow(map.radius, 3) / std::max(forecast.volume, 1e-300);
    if (held < 1 && forecast.photons > 0 && e.integer("neighbors") == 0)
      setup.notes.push_back(fmt::format(
          "estimator.radius = {:.4g} holds {:.2g} photons where the mean photon is: light that is "
          "scattered many times will be specks or none (0 would be {:.4g})",
          e.real("radius"), held,
          estimators::automaticRadius(*setup.medium, whole) / setup.space.metersPerUnit));
    return;
  }
  // Where the nearest photons make the radius, the automatic one only keeps it from growing over
  // empty space.
  map.radius = e.integer("neighbors") > 0 ? kWidestBall * setup.medium->voxelEdge()
                                          : estimators::automaticRadius(*setup.medium, whole);
}

std::unique_ptr<estimators::PhotonMap> photonMapPass(const FrameSetup& setup, int pass,
                                                     double widening, FrameStatistics& statistics) {
  const Stopwatch watch;
  PhotonMapLayout layout = *setup.photonMap;
  layout.radius *= widening * estimators::progressiveRadiusFactor(pass);
  transport::TraceStatistics traced;
  auto map = estimators::tracePhotonMap(*setup.medium, setup.lights, layout,
                                        traceOptions(setup, pass), traced);
  addTraced(traced, statistics);
  statistics.photonsStored += map->photons();
  statistics.lightMemoryBytes = std::max(statistics.lightMemoryBytes, map->memoryBytes());
  statistics.seconds.trace += watch.seconds();
  return map;
}

}  // namespace photosphere::scene
