#include "photosphere/study/paper.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <map>

#include "child.h"
#include "contenders.h"
#include "machine.h"
#include "paper_exhibits.h"
#include "particle_cache.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/core/progress.h"
#include "photosphere/core/resources.h"
#include "photosphere/estimators/photon_map.h"
#include "photosphere/image/exr.h"
#include "reference.h"

namespace photosphere::study {

namespace fs = std::filesystem;

namespace {

constexpr int kEdge = 64, kQuickEdge = 16;
constexpr std::int64_t kPhotons = 200'000, kQuickPhotons = 2'000;
constexpr int kRepeats = 3;
constexpr double kMinutes = 20, kQuickMinutes = 0.2;
/// Part of the time that references may take.
constexpr double kReferenceShare = 0.25;

class Paper {
 public:
  explicit Paper(const StudyOptions& options)
      : m_options(options),
        m_cache(options.cache.empty() ? options.output / "cache" : options.cache),
        m_runs(m_cache / fmt::format("runs-{}", getpid())),
        m_edge(options.quick ? kQuickEdge : kEdge),
        m_plans(paperExhibits(options.quick ? kQuickPhotons : kPhotons)) {
    m_minutes = options.minutes > 0 ? options.minutes : options.quick ? kQuickMinutes : kMinutes;
  }

  PaperResult run() {
    PaperResult result;
    describeRun(m_options, result);
    result.minutes = m_minutes;
    result.width = result.height = m_edge;
    prepare(result);
    Progress progress("paper", kRepeats * m_tasks.size());
    // Every line once before any a second time: what time allows then covers all exhibits.
    for (int repeat = 0; repeat < kRepeats; ++repeat)
      for (Task& task : m_tasks) {
        if (task.why.empty() && (repeat == 0 || !task.images.empty())) renderOnce(task, repeat);
        progress.add(1);
      }
    for (Task& task : m_tasks)
      finish(task, result.exhibits[task.exhibit].rows[task.row]);
    result.elapsedSeconds = m_watch.seconds();
    return result;
  }

 private:
  // One line of an exhibit and what its runs gave.
  struct Task {
    const PaperFrame* frame = nullptr;
    std::size_t exhibit = 0, row = 0;
    SceneSource bare;  // the scene without the estimator's settings
    scene::SceneFile scene;
    std::vector<double> seconds, memory;
    std::vector<image::Image> images;
    std::string why;  // not measured
  };

  bool late() const { return m_watch.seconds() > 60 * m_minutes; }

  SceneSource sceneOf(const PaperFrame& frame) const {
    const fs::path studies = shippedStudies();
    if (studies.empty())
      throw InputMissingError("data/studies",
                              "the scenes of --paper are not found; set PHOTOSPHERE_DATA to the "
                              "folder that holds studies/");
    SceneSource source{studies / (frame.smoke + ".toml"), {}};
    // One ray a pixel, as a renderer of 2010 would march: times are compared, not edges.
    source.sets = {
        "render.samples=1", fmt::format("camera.resolution=[{}, {}]", m_edge, m_edge),
        fmt::format("volume.0.phase={{ type = \"henyey_greenstein\", g = {} }}", frame.g)};
    return source;
  }

  // Opens the scenes of all lines: what this version does not serve shows here.
  void prepare(PaperResult& result) {
    for (const ExhibitPlan& plan : m_plans) {
      PaperExhibit exhibit{plan.name, plan.title,    plan.said, plan.differs,
                           plan.unit, plan.pictures, {}};
      for (const PaperFrame& frame : plan.frames) {
        Task task;
        task.frame = &frame;
        task.exhibit = result.exhibits.size();
        task.row = exhibit.rows.size();
        PaperRow row;
        row.label = frame.label;
        row.paperValue = frame.paperValue;
        row.settings = fmt::format("{}", fmt::join(frame.sets, "; "));
        open(task, row);
        exhibit.rows.push_back(std::move(row));
        m_tasks.push_back(std::move(task));
      }
      result.exhibits.push_back(std::move(exhibit));
    }
    result.renderingSpace = sceneOf(m_plans[0].frames[0]).open().output.text("colorspace");
  }

  void open(Task& task, PaperRow& row) {
    const PaperFrame& frame = *task.frame;
    task.bare = sceneOf(frame);
    try {
      const auto particles = particleSets(task.bare, {frame.frame}, frame.particles, true, m_cache);
      task.scene = task.bare.with(frame.sets).with(particles).open();
      countLight(frame, task.scene, row);
    } catch (const InterruptedError&) {
      throw;
    } catch (const Error& error) {
      task.why = error.what();
    }
  }

  void countLight(const PaperFrame& frame, const scene::SceneFile& scene, PaperRow& row) const {
    if (frame.stored == StoredLight::forecast)
      row.lightBytes = static_cast<double>(sceneFacts(scene, frame.frame).lightBytes);
    if (frame.stored == StoredLight::photons)
      row.lightBytes = static_cast<double>(estimators::photonMapBytes({}, frame.photonsStored));
  }

  void renderOnce(Task& task, int repeat) {
    if (late()) {
      if (repeat == 0) task.why = "the time given was spent; more --minutes measure it";
      return;
    }
    RenderJob job;
    job.scene = task.scene;
    job.frame = task.frame->frame;
    job.request.seed = 1 + repeat;
    job.image = m_runs.path() / "paper.exr";
    const RenderOutcome outcome = renderInChild(job);
    if (outcome.failed) {
      task.why = outcome.message;
      return;
    }
    task.seconds.push_back(outcome.seconds.resolve + outcome.seconds.march);
    task.memory.push_back(static_cast<double>(outcome.peakMemoryBytes));
    task.images.push_back(image::readExr(job.image).image);
  }

  void finish(Task& task, PaperRow& row) {
    row.why = task.why;
    if (task.images.empty()) return;
    row.seconds = spreadOf(task.seconds);
    row.peakMemoryBytes = spreadOf(task.memory);
    row.measured = true;
    judge(*task.frame, task.bare, task.images, row);
    row.frame = std::move(task.images.front());
  }

  void judge(const PaperFrame& frame, const SceneSource& bare,
             const std::vector<image::Image>& images, PaperRow& row) {
    const ReferenceImage& reference = referenceOf(frame, bare);
    std::vector<Planes> seeds;
    for (const image::Image& image : images) {
      Planes planes;
      for (const char* letter : {"R", "G", "B"})
        planes.push_back(image.channel(std::string("multiple.") + letter));
      seeds.push_back(std::move(planes));
    }
    const ErrorFigures figures =
        errorFigures(seeds, reference.mean(kMultiple), reference.variance(kMultiple), {});
    row.meanRatio = figures.meanRatio;
    row.relativeError = relativeError(figures);
    row.judged = true;
  }

  const ReferenceImage& referenceOf(const PaperFrame& frame, const SceneSource& bare) {
    const std::string name = fmt::format("paper-{}-{}-g{}", frame.smoke, frame.frame, frame.g);
    const bool white = std::any_of(frame.sets.begin(), frame.sets.end(),
                                   [](const std::string& s) { return s.rfind("light.", 0) == 0; });
    const std::string id = name + (white ? "-white" : "");
    const auto found = m_references.find(id);
    if (found != m_references.end()) return found->second;
    SceneSource source = bare;
    for (const std::string& set : frame.sets)
      if (set.rfind("light.", 0) == 0) source.sets.push_back(set);
    const scene::SceneFile base = source.open();
    ReferenceMaker maker(source, frame.frame, id,
                         referenceKey(base, frame.frame, sceneFacts(base, frame.frame).mediumHash),
                         m_cache, m_options.quick ? 4 : 64);
    const Stopwatch watch;
    // About eight references share the time that is theirs.
    const double most = kReferenceShare * 60 * m_minutes / 8;
    while (maker.image().pairs < 2 ||
           (maker.samplesBefore() == 0 && watch.seconds() + maker.pairSeconds() < most))
      maker.addPair();
    return m_references.emplace(id, maker.image()).first->second;
  }

  const StudyOptions& m_options;
  fs::path m_cache;
  RunFolder m_runs;
  int m_edge;
  double m_minutes = 0;
  std::vector<ExhibitPlan> m_plans;
  std::vector<Task> m_tasks;
  Stopwatch m_watch;
  std::map<std::string, ReferenceImage> m_references;
};

double ratio(double value, double base) {
  return value > 0 && base > 0 ? value / base : 0;
}

double ourValue(const PaperExhibit& exhibit, const PaperRow& row) {
  return exhibit.unit == "bytes" ? row.lightBytes : row.measured ? row.seconds.median : 0;
}

}  // namespace

double ourRatio(const PaperExhibit& exhibit, const PaperRow& row) {
  return ratio(ourValue(exhibit, row), ourValue(exhibit, exhibit.rows.front()));
}

double papersRatio(const PaperExhibit& exhibit, const PaperRow& row) {
  return ratio(row.paperValue, exhibit.rows.front().paperValue);
}

PaperResult runPaper(const StudyOptions& options) {
  return Paper(options).run();
}

}  // namespace photosphere::study
