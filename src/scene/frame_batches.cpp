#include "frame_batches.h"

#include <fmt/format.h>

#include <algorithm>

#include "estimator_options.h"
#include "layer_renderer.h"
#include "light_stage.h"
#include "photon_map_stage.h"

namespace photosphere::scene {

namespace {

// A basis that can go negative is clamped where it is read.
void noteClamped(double share, FrameSetup& setup, FrameStatistics& statistics) {
  statistics.clampedLight = share;
  if (!(share > 0.001)) return;
  setup.notes.push_back(fmt::format(
      "{:.2g} of the stored light is below zero toward where it is read and counts as 0, a bias of "
      "the basis beside sharp peaks; raise estimator.{}",
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

using Source = std::unique_ptr<estimators::InscatterSource>;

// The light of one pass of a frame, ready to be looked up; null where nothing asks for it.
struct PassLight {
  Source source;
  Source wider;  // the same photons through a wider kernel, where that is asked for
};

// Share of the squared target that noise and doubt may have in an estimate that stands.
constexpr double kSettled = 0.1;

// How much wider.
constexpr double kWidening = 1.5;

Source widened(const FrameSetup& setup, estimators::LightField field) {
  // A kernel narrower than a light voxel does nothing: the voxel itself is the width there.
  const double edge = field.layout.lightVoxel * setup.medium->voxelEdge();
  field.layout.radius = kWidening * std::max(field.layout.radius, edge);
  return estimators::resolve(*setup.medium, std::move(field), setup.view, setup.key);
}

PassLight prepareLight(const SceneFile& scene, const RenderRequest& request, int pass, bool wider,
                       FrameSetup& setup, FrameResult& result) {
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
  estimators::LightField field = lightField(scene, request, setup, result.statistics);
  result.layout = describeLayout(setup.layout);
  result.radius = setup.layout.radius / setup.space.metersPerUnit;
  const Stopwatch watch;
  if (wider) light.wider = widened(setup, field);
  auto source = estimators::resolve(*setup.medium, std::move(field), setup.view, setup.key);
  result.statistics.seconds.resolve += watch.seconds();
  noteClamped(source->clampedShare(), setup, result.statistics);
  light.source = std::move(source);
  return light;
}

// The frame in independent batches, each of photons, samples and random numbers of its own, until
// its error or the time is what was asked for.
class FrameLoop {
 public:
  FrameLoop(const SceneFile& scene, const RenderRequest& request, const render::Crop& crop,
            const Stopwatch& watch, FrameSetup& setup, FrameResult& result)
      : m_scene(scene),
        m_request(request),
        m_crop(crop),
        m_watch(watch),
        m_setup(setup),
        m_result(result),
        m_target(scene.render.real("target_error")),
        m_timeLimit(scene.render.real("time_limit")),
        m_passes(setup.photonMap ? setup.photonMap->passes : 1),
        m_checked(m_target > 0 && storesLight(scene, setup)),
        m_key(setup.key),
        m_error(crop.max.x - crop.min.x) {}

  void run() {
    do {
      if (wantsBatch())
        renderBatch();
      else
        renderTruth();
    } while (!done());
    if (!once()) m_result.layers = m_mean.mean();
    m_result.statistics.batches = m_batches;
    if (m_setup.batches > 1) reportError();
  }

 private:
  // Stored light is biased, so its frames are held against path traced ones: turn by turn at
  // first, then whichever leaves the greater doubt is rendered.
  bool wantsBatch() const {
    if (!m_checked) return true;
    if (m_error.truths() < m_setup.batches) return m_batches <= m_error.truths();
    return m_estimate.noise >= m_estimate.doubt;
  }

  // One batch: all passes of a progressive photon map, one of everything else.
  void renderBatch() {
    m_setup.key = m_batches == 0 ? m_key : RandomKey::fromSeed(seed(), m_batches);
    const bool judged = m_setup.batches > 1;
    const bool wider = m_target > 0 && m_batches < m_setup.batches;
    const std::size_t notes = m_setup.notes.size();
    for (int pass = 0; pass < m_passes; ++pass) {
      const PassLight light = prepareLight(m_scene, m_request, pass, wider, m_setup, m_result);
      const Stopwatch watch;
      if (!m_renderer) m_renderer.emplace(m_scene, m_crop, m_setup);
      render::FrameLayers layers = m_renderer->render(light.source.get(), pass);
      if (!once()) m_mean.add(layers);
      if (light.wider)
        m_error.add(layers.beauty, m_renderer->render(light.wider.get(), pass).beauty, kWidening);
      else if (judged)
        m_error.add(layers.beauty);
      if (once()) m_result.layers = std::move(layers);
      m_result.statistics.seconds.march += watch.seconds();
    }
    // What a batch has to say it says once.
    if (m_batches++ > 0) m_setup.notes.resize(notes);
    m_setup.key = m_key;
  }

  void renderTruth() {
    const Stopwatch watch;
    // Another seed than the batches': its bits turned over.
    m_error.addTruth(m_renderer->truth(RandomKey::fromSeed(~seed(), m_error.truths())));
    m_result.statistics.seconds.check += watch.seconds();
  }

  std::uint64_t seed() const { return static_cast<std::uint64_t>(m_key.hi) << 32 | m_key.lo; }
  bool once() const { return m_setup.batches == 1 && m_passes == 1; }

  // Fewer parts than the frame is judged by.
  bool tooFew() const {
    return m_batches < m_setup.batches || (m_checked && m_error.truths() < m_setup.batches);
  }

  bool done() {
    const bool late = m_timeLimit > 0 && m_watch.seconds() > m_timeLimit;
    if (tooFew()) return late;
    if (!(m_target > 0)) return true;
    const ErrorEstimate e = m_estimate = m_error.estimate();
    if (late || met(e)) return true;
    // Photons do not mend a bias that is beyond doubt.
    const double sure = e.bias * e.bias - 2 * e.doubt * e.doubt;
    return (sure >= m_target * m_target && e.noise < 0.5 * e.bias) || settled(e);
  }

  // More batches and truths would change the estimate by little.
  bool settled(const ErrorEstimate& e) const {
    return e.noise * e.noise + e.doubt * e.doubt <= kSettled * m_target * m_target;
  }
  bool met(const ErrorEstimate& e) const {
    return e.bound() <= m_target || (settled(e) && e.total() <= m_target);
  }

  void reportError() {
    FrameStatistics& s = m_result.statistics;
    // Every batch traced all the light there is.
    for (Vec3d* power : {&s.energyEmitted, &s.energyMissed, &s.energyAbsorbed, &s.energyEscaped,
                         &s.energyCapped, &s.energyError})
      *power /= static_cast<double>(m_batches);
    const bool wanted = m_target > 0;
    s.targetMissed = wanted && tooFew();
    if (s.targetMissed)
      m_setup.notes.push_back(fmt::format(
          "render.time_limit ended the frame after {} of the {} parts that its error is judged by; "
          "raise it, or lower estimator.photons",
          m_batches < m_setup.batches ? m_batches : m_error.truths(), m_setup.batches));
    if (m_batches < 2) return;
    s.error = wanted && !tooFew() ? m_estimate : m_error.estimate();
    m_result.error = m_error.standardError();
    m_result.layerNames.emplace_back("error");
    if (!wanted || tooFew() || met(*s.error)) return;
    s.targetMissed = true;
    m_setup.notes.push_back(fmt::format(
        "the estimated error {:.4g} (noise {:.4g}, bias {:.4g}, unsure by {:.4g}) misses "
        "render.target_error {:.4g}: {}",
        s.error->total(), s.error->noise, s.error->bias, s.error->doubt, m_target,
        s.error->bias >= m_target ? "lower estimator.radius or light_voxel"
                                  : "raise render.time_limit"));
  }

  const SceneFile& m_scene;
  const RenderRequest& m_request;
  const render::Crop& m_crop;
  const Stopwatch& m_watch;
  FrameSetup& m_setup;
  FrameResult& m_result;
  double m_target, m_timeLimit;
  int m_passes, m_batches = 0;
  bool m_checked;  ///< against path traced frames
  RandomKey m_key;
  std::optional<LayerRenderer> m_renderer;
  render::FrameMean m_mean;
  FrameError m_error;
  ErrorEstimate m_estimate;  // once there are enough parts
};

}  // namespace

void renderBatches(const SceneFile& scene, const RenderRequest& request, const render::Crop& crop,
                   const Stopwatch& watch, FrameSetup& setup, FrameResult& result) {
  FrameLoop(scene, request, crop, watch, setup, result).run();
}

}  // namespace photosphere::scene
