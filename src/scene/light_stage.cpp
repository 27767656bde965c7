#include "light_stage.h"

#include "photosphere/core/error.h"
#include "photosphere/core/resources.h"

namespace photosphere::scene {

namespace {

void report(const transport::TraceStatistics& traced, const estimators::LightFieldLayout& layout,
            FrameStatistics& s) {
  s.photonsEmitted = traced.photons;
  s.photonsScattered = traced.scatterings;
  // Every flight after a scattering leaves light; the first one does where lamps with extent are
  // kept.
  s.photonsStored = layout.unscattered ? traced.flights : traced.scatterings;
  s.photonsCapped = traced.capped;
  s.majorantViolations += traced.majorantViolations;
  s.energyEmitted = traced.emitted;
  s.energyMissed = traced.missed;
  s.energyAbsorbed = traced.absorbed;
  s.energyEscaped = traced.escaped;
  s.energyCapped = traced.cappedPower;
  s.energyError = traced.imbalance();
}

}  // namespace

estimators::LightField lightField(const SceneFile& scene, const RenderRequest&, FrameSetup& setup,
                                  FrameStatistics& statistics) {
  const Stopwatch watch;
  if (!scene.estimator.text("cache").empty())
    throw ConfigError("[estimator]: 'cache' is not served by this version yet");
  transport::TraceOptions options;
  options.photons = static_cast<std::uint64_t>(scene.estimator.integer("photons"));
  options.key = setup.key;
  transport::TraceStatistics traced;
  estimators::LightField field = estimators::traceLightField(
      *setup.medium, setup.lights, setup.layout, setup.view, setup.particles, options, traced);
  report(traced, setup.layout, statistics);
  statistics.seconds.trace = watch.seconds();
  return field;
}

void storeLightField(const FrameSetup&, const estimators::LightField&, const std::string&) {
  throw ConfigError("writing a light cache is not served by this version yet");
}

}  // namespace photosphere::scene
