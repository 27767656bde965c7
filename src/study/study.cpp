#include "photosphere/study/study.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "child.h"
#include "flicker.h"
#include "hard_cases.h"
#include "machine.h"
#include "particle_cache.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"
#include "sweep.h"

namespace photosphere::study {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kParticles = 60'000;
constexpr double kMinutes = 10, kQuickMinutes = 0.1;
constexpr int kQuickEdge = 32;
constexpr int kHardEdge = 128;

// Parts of the time, of what is left when each begins.
constexpr double kMeasureShare = 0.35, kReferenceShare = 0.45, kHardShare = 0.6;
// Of all of it.
constexpr double kBasesShare = 0.3;

Vec2i resolutionOf(const scene::SceneFile& scene) {
  const Vec2d size = scene.camera.vec2("resolution");
  return {static_cast<int>(size.x), static_cast<int>(size.y)};
}

class Study {
 public:
  explicit Study(const StudyOptions& options)
      : m_options(options),
        m_cache(options.cache.empty() ? options.output / "cache" : options.cache),
        m_runs(m_cache / fmt::format("runs-{}", getpid())),
        m_seconds(60 * (options.minutes > 0 ? options.minutes
                        : options.quick     ? kQuickMinutes
                                            : kMinutes)) {
    if (options.seeds < 3)
      throw ConfigError("--seeds: at least 3, as bias and variance need independent frames");
    m_source.path = options.scene;
    m_source.sets = options.sets;
    const scene::SceneFile scene = m_source.open();
    const std::string smaller = resolutionOverride(resolutionOf(scene), options.quick);
    if (!smaller.empty()) m_source.sets.push_back(smaller);
    if (options.bases) m_reserve = kBasesShare * m_seconds;
    m_frames = options.frames.empty() ? scene::sceneFrames(scene) : options.frames;
    m_frame = m_frames.back();
  }

  StudyResult run() {
    StudyResult result;
    describe(result);
    m_particles = particleSets(m_source, movingFrames(), kParticles, false, m_cache);
    const bool more = m_options.hardCases || m_options.flicker;
    Sweep main(mainPlan(more));
    main.measure();
    main.refine();
    result.sweeps.push_back(main.evaluate());
    if (m_options.hardCases) runHardCases(result);
    if (m_options.flicker) runFlicker(result);
    m_reserve = 0;
    if (m_options.bases) runBases(result);
    result.elapsedSeconds = m_watch.seconds();
    return result;
  }

 private:
  double left() const { return std::max(0.0, m_seconds - m_reserve - m_watch.seconds()); }
  std::string name() const { return fileStem(m_options.scene.stem().string()); }

  std::vector<std::int64_t> movingFrames() const {
    return m_options.flicker ? m_frames : std::vector<std::int64_t>{m_frame};
  }

  // A child that does nothing: what each run's seconds and memory hold beside its work.
  void measureStart(StudyResult& result) const {
    std::vector<double> seconds;
    for (int i = 0; i < 5; ++i) {
      const ChildResult child = runInChild([] { return std::to_string(peakMemoryBytes()); });
      seconds.push_back(child.seconds);
      if (!child.failed) result.startMemoryBytes = std::stoull(child.text);
    }
    result.startSeconds = spreadOf(seconds);
  }

  void describe(StudyResult& result) const {
    result.scene = m_options.scene.string();
    result.frame = m_frame;
    describeRun(m_options, result);
    result.renderingSpace = m_source.open().output.text("colorspace");
    result.minutes = m_seconds / 60;
    measureStart(result);
  }

  SweepPlan plan(const SceneSource& source, const std::string& name) const {
    SweepPlan plan;
    plan.scene = source;
    plan.frame = m_frame;
    plan.name = name;
    plan.seeds = m_options.seeds;
    plan.particleSets = m_particles;
    plan.cacheFolder = m_cache;
    plan.runFolder = m_runs.path();
    plan.referenceName = this->name() + (name == "scene" ? "" : "-" + name);
    plan.chunk = m_options.quick ? 4 : 64;
    return plan;
  }

  SweepPlan mainPlan(bool more) const {
    SweepPlan main = plan(m_source, "scene");
    main.description = "the scene as it is";
    main.size = m_options.quick ? SweepSize::quick() : SweepSize::full();
    if (!m_options.families.empty()) main.size.families = m_options.families;
    main.measureSeconds = left() * (more ? kMeasureShare : 0.45);
    main.referenceSeconds = left() * (more ? kMeasureShare : 0.55);
    return main;
  }

  // The scene in fewer pixels.
  SceneSource small(const SceneFacts& facts) const {
    SceneSource base = m_source;
    if (const int edge = std::max(facts.width, facts.height); edge > kHardEdge)
      base.sets.push_back(fmt::format("camera.resolution=[{}, {}]",
                                      std::max(1, facts.width * kHardEdge / edge),
                                      std::max(1, facts.height * kHardEdge / edge)));
    return base;
  }

  void runHardCases(StudyResult& result) {
    const scene::SceneFile scene = m_source.open();
    const SceneFacts facts = sceneFacts(scene, m_frame);
    runCases(hardCases(scene, facts), small(facts), SweepSize::hardCase(m_options.quick),
             left() * (m_options.flicker ? kHardShare : 1.0), result.sweeps);
  }

  void runBases(StudyResult& result) {
    const scene::SceneFile scene = m_source.open();
    runCases(basisCases(scene, m_options.quick), small(sceneFacts(scene, m_frame)),
             SweepSize::bases(m_options.quick), left(), result.bases);
  }

  void runCases(const std::vector<HardCase>& cases, const SceneSource& base, const SweepSize& size,
                double budget, std::vector<SweepResult>& results) {
    const double end = m_watch.seconds() + budget;
    for (std::size_t i = 0; i < cases.size(); ++i) {
      const HardCase& c = cases[i];
      const double share =
          std::max(0.0, end - m_watch.seconds()) / static_cast<double>(cases.size() - i);
      SweepPlan hard = plan(base.with(c.sets), c.name);
      hard.description = c.description;
      hard.size = size;
      hard.seeds = 3;
      if (c.particles > 0) {
        hard.particleSets = particleSets(base, {m_frame}, c.particles, true, m_cache);
        hard.size.families.insert(hard.size.families.end(),
                                  {"particles_view", "particles_collision"});
      }
      hard.measureSeconds = (1 - kReferenceShare) * share;
      hard.referenceSeconds = kReferenceShare * share;
      Sweep sweep(std::move(hard));
      sweep.measure();
      sweep.refine();
      results.push_back(sweep.evaluate());
    }
  }

  void runFlicker(StudyResult& result) {
    FlickerPlan flicker;
    flicker.scene = m_source;
    flicker.frame = m_frame;
    flicker.moving = m_frames;
    if (m_options.quick) flicker.stillFrames = 2;
    flicker.quick = m_options.quick;
    flicker.particleSets = m_particles;
    flicker.cacheFolder = m_cache;
    flicker.runFolder = m_runs.path();
    flicker.referenceName = name();
    flicker.chunk = m_options.quick ? 4 : 64;
    flicker.seconds = left();
    result.flicker = measureFlicker(flicker, result.leftOut);
  }

  const StudyOptions& m_options;
  fs::path m_cache;
  RunFolder m_runs;
  Stopwatch m_watch;
  double m_seconds, m_reserve = 0;  // the second for what comes last
  SceneSource m_source;
  std::vector<std::int64_t> m_frames;
  std::int64_t m_frame = 1;
  std::vector<std::string> m_particles;
};

}  // namespace

std::string resolutionOverride(const Vec2i& resolution, bool quick) {
  const int most = quick ? kQuickEdge : kLargestEdge;
  const int edge = std::max(resolution.x, resolution.y);
  if (edge <= most) return {};
  const auto scaled = [&](int size) {
    return std::max(1, static_cast<int>(std::lround(static_cast<double>(size) * most / edge)));
  };
  return fmt::format("camera.resolution=[{}, {}]", scaled(resolution.x), scaled(resolution.y));
}

StudyResult runStudy(const StudyOptions& options) {
  return Study(options).run();
}

}  // namespace photosphere::study
