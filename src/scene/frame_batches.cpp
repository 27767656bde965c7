#include "frame_batches.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "layer_renderer.h"
#include "pass_light.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"

namespace photosphere::scene {

namespace {

// Share of the squared target that noise and doubt may have in an estimate that stands.
constexpr double kSettled = 0.1;

// Paths from the lamps take longer: they are the truth where their squared noise is this part of
// that of paths from the eye.
constexpr double kFarQuieter = 0.3;
// Collisions in view below which it is not known how noisy they are.
constexpr std::uint64_t kFewestJoined = 100;

constexpr const char* kPart = "frame";  // of the checkpoint

// What batches add up.
template <class Statistics, class State>
void eachNumber(Statistics& s, State& state) {
  state.value(s.seconds);
  state.value(s.photonsEmitted);
  state.value(s.photonsScattered);
  state.value(s.photonsStored);
  state.value(s.photonsCapped);
  state.value(s.lightMemoryBytes);
  for (auto* power : {&s.energyEmitted, &s.energyMissed, &s.energyAbsorbed, &s.energyEscaped,
                      &s.energyCapped, &s.energyError})
    state.value(*power);
  state.value(s.majorantViolations);
  state.value(s.negativeLight);
  state.value(s.pathsCapped);
  state.value(s.pathsCappedRadiance);
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
    resume();
    try {
      while (m_batches == 0 || !done())
        if (wantsBatch())
          renderBatch();
        else
          renderTruth();
    } catch (const InterruptedError&) {
      // What this part keeps of its own accord is more than this.
      if (!m_partKept) keepParts();
      throw;
    }
    if (!once()) m_result.layers = m_mean.mean();
    m_result.statistics.batches = m_batches;
    m_result.statistics.seconds.total += m_secondsBefore;
    if (m_setup.batches > 1) reportError();
  }

 private:
  // Stored light is biased, so its frames are held against unbiased ones: turn by turn at
  // first, then whichever leaves the greater doubt is rendered.
  bool wantsBatch() const {
    if (!m_checked) return true;
    if (m_error.truths() < m_setup.batches) return m_batches <= m_error.truths();
    return m_estimate.noise >= m_estimate.doubt;
  }

  // One batch: all passes of a progressive photon map, one of everything else.
  void renderBatch() {
    m_setup.key = m_batches == 0 ? m_key : RandomKey::fromSeed(seed(), m_batches);
    for (; m_pass < m_passes; ++m_pass) {
      if (m_pass > 0) offer();
      renderPass();
    }
    m_pass = 0;
    ++m_batches;
    m_setup.key = m_key;
    offer();
  }

  void renderPass() {
    const bool judged = m_setup.batches > 1;
    const bool wider = m_target > 0 && m_batches < m_setup.batches;
    m_statisticsBefore = m_result.statistics;
    m_notesBefore = m_setup.notes.size();
    const PassLight light =
        prepareLight(m_scene, m_request, m_batches, m_pass, wider, m_setup, m_result);
    // What a batch has to say it says once.
    if (m_batches > 0 || m_pass > 0) m_setup.notes.resize(m_notesBefore);
    const Stopwatch watch;
    if (!m_renderer) m_renderer.emplace(m_scene, m_crop, m_setup);
    std::vector<Rgb> multiple;
    const double tracedBefore = m_result.statistics.seconds.trace;
    if (m_setup.lightPaths)
      multiple = m_renderer->lightPaths(m_request.checkpoint, static_cast<std::uint64_t>(m_batches),
                                        m_result.statistics);
    const double traced = m_result.statistics.seconds.trace - tracedBefore;
    StateReader* begun = m_film ? &*m_film : nullptr;
    render::FrameLayers layers = m_renderer->render(light.source.get(), m_pass, begun, filmPause());
    m_film.reset();
    if (!multiple.empty()) render::setMultiple(layers, std::move(multiple));
    std::optional<render::FrameLayers> throughWider;
    if (light.wider) throughWider = m_renderer->render(light.wider.get(), m_pass);
    // From here on nothing interrupts: what is kept has all of a pass or nothing.
    if (!once()) m_mean.add(layers);
    if (throughWider)
      m_error.add(layers.beauty, throughWider->beauty, kWidening);
    else if (judged)
      m_error.add(layers.beauty);
    if (once()) m_result.layers = std::move(layers);
    m_result.statistics.seconds.march += watch.seconds() - traced;
    m_partKept = false;
  }

  void renderTruth() {
    const Stopwatch watch;
    if (!m_renderer) m_renderer.emplace(m_scene, m_crop, m_setup);
    if (m_fromLamps)
      m_error.addTruth(truth(m_error.truths(), *m_fromLamps).beauty);
    else
      beginTruths();
    m_result.statistics.seconds.check += watch.seconds();
    offer();
  }

  // Two truths by paths from the eye, or two from the lamps where those are far quieter. Not by
  // what they take: the choice is a matter of bits, not of the clock.
  void beginTruths() {
    const auto two = [&](bool fromLamps) {
      return std::array{truth(0, fromLamps), truth(1, fromLamps)};
    };
    // What is kept after a signal knows of no choice before both ends have been tried.
    auto truths = two(false);
    bool fromLamps = false;
    if (!m_setup.medium->isMoving() && !m_setup.motion)
      if (auto lamps = two(true); areFarQuieter(lamps, truths)) {
        fromLamps = true;
        truths = std::move(lamps);
      }
    m_fromLamps = fromLamps;
    for (const Truth& frame : truths)
      m_error.addTruth(frame.beauty);
  }

  bool areFarQuieter(const std::array<Truth, 2>& lamps, const std::array<Truth, 2>& eye) const {
    if (std::min(lamps[0].joined, lamps[1].joined) < kFewestJoined) return false;
    const auto noise =
        blockNoise({&eye[0].beauty, &eye[1].beauty}, {&lamps[0].beauty, &lamps[1].beauty},
                   m_crop.max.x - m_crop.min.x);
    return noise && (*noise)[1] < kFarQuieter * (*noise)[0];
  }

  // Of another seed than the batches': its bits turned over.
  Truth truth(int index, bool fromLamps) const {
    return m_renderer->truth(RandomKey::fromSeed(~seed(), index), fromLamps);
  }

  // Between parts. A frame of one part is done when that is, and needs keeping no more.
  void offer() {
    m_statisticsBefore = m_result.statistics;
    m_notesBefore = m_setup.notes.size();
    if (m_request.checkpoint && !once())
      m_request.checkpoint->offer(kPart, [&](StateWriter& w) { keep(w); });
  }
  void keepParts() const {
    if (m_request.checkpoint && m_batches + m_pass > 0)
      m_request.checkpoint->save(kPart, [&](StateWriter& w) { keep(w); });
  }
  PausePoint filmPause() {
    if (!m_request.checkpoint) return {};
    return [&](const WriteState& film) {
      m_request.checkpoint->offer(kPart, [&](StateWriter& w) {
        keep(w);
        w.value(true);
        film(w);
        m_partKept = true;
      });
    };
  }

  // All that the parts that are done have left.
  void keep(StateWriter& w) const {
    w.value(m_batches);
    w.value(m_pass);
    w.value(m_secondsBefore + m_watch.seconds());
    eachNumber(m_statisticsBefore, w);
    w.value(m_estimate);
    w.value(m_fromLamps);
    w.text(m_result.layout);
    w.value(m_result.radius);
    w.value(static_cast<std::uint64_t>(m_notesBefore));
    for (std::size_t i = 0; i < m_notesBefore; ++i)
      w.text(m_setup.notes[i]);
    m_mean.keep(w);
    m_error.keep(w);
  }

  void resume() {
    if (!m_request.checkpoint) return;
    std::optional<StateReader> kept = m_request.checkpoint->load(kPart);
    if (!kept) return;
    kept->value(m_batches);
    kept->value(m_pass);
    kept->value(m_secondsBefore);
    eachNumber(m_result.statistics, *kept);
    kept->value(m_estimate);
    kept->value(m_fromLamps);
    m_result.layout = kept->text();
    kept->value(m_result.radius);
    m_setup.notes.clear();
    for (auto notes = kept->value<std::uint64_t>(); notes > 0; --notes)
      m_setup.notes.push_back(kept->text());
    m_mean.resume(*kept);
    m_error.resume(*kept);
    log::info("frame {} goes on from what {:.1f} s have made of it", m_setup.frame,
              m_secondsBefore);
    if (kept->atEnd()) return;
    kept->value<bool>();
    m_film = std::move(kept);
    m_partKept = true;
  }

  std::uint64_t seed() const { return static_cast<std::uint64_t>(m_key.hi) << 32 | m_key.lo; }
  bool once() const { return m_setup.batches == 1 && m_passes == 1; }

  // Fewer parts than the frame is judged by.
  bool tooFew() const {
    return m_batches < m_setup.batches || (m_checked && m_error.truths() < m_setup.batches);
  }

  bool done() {
    const bool late = m_timeLimit > 0 && m_secondsBefore + m_watch.seconds() > m_timeLimit;
    if (tooFew()) return late;
    if (!(m_target > 0)) return true;
    const ErrorEstimate e = m_estimate = m_error.estimate();
    if (late || met(e) || !std::isfinite(e.bound())) return true;
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
    if (!std::isfinite(s.error->bound())) {
      m_setup.notes.push_back(
          "the frame is brighter than a float can say, so its error cannot be told: lower the "
          "lights' power");
      return;
    }
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
  int m_passes;
  int m_batches = 0, m_pass = 0;       // done; of the batch under way
  double m_secondsBefore = 0;          // of earlier runs
  FrameStatistics m_statisticsBefore;  // without the pass under way
  std::size_t m_notesBefore = 0;       // the same
  std::optional<StateReader> m_film;   // what an earlier run had of the pass under way
  bool m_partKept = false;             // the checkpoint has some of the pass under way
  bool m_checked;                      // against unbiased frames
  std::optional<bool> m_fromLamps;     // where their paths begin, once there are some
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
