#include "flicker.h"

#include <fmt/format.h>

#include "child.h"
#include "photosphere/core/error.h"
#include "photosphere/core/progress.h"
#include "photosphere/core/resources.h"
#include "photosphere/image/exr.h"
#include "photosphere/image/metrics.h"

namespace photosphere::study {

namespace fs = std::filesystem;

namespace {

/// Seeds of different sequences share no frame's random numbers.
constexpr std::int64_t kSeedStride = 1000;
/// Part of the time that references of moving frames may take.
constexpr double kReferenceShare = 0.4;

struct Shot {
  std::string name;
  std::vector<std::int64_t> frames;
  bool still = false;
  std::vector<ReferenceImage> references;  ///< one a frame
};

class FlickerMeter {
 public:
  FlickerMeter(const FlickerPlan& plan, std::vector<LeftOut>& leftOut)
      : m_plan(plan), m_leftOut(leftOut) {
    SweepSize size{{plan.quick ? 1'000 : 64'000},
                   {plan.quick ? 2 : 16},
                   {},
                   {"view", "histogram_32", "particles_view", "photon_map", "path_traced"}};
    if (plan.quick) size.families = {"view", "path_traced"};
    std::vector<LeftOut> refused;  // the main sweep has reported them
    m_contenders = contenders(plan.scene, size, plan.particleSets, refused);
  }

  std::vector<FlickerRow> run() {
    std::vector<Shot> shots{still()};
    if (m_plan.moving.size() >= 2)
      shots.push_back(moving());
    else
      m_leftOut.push_back({"flicker of a moving sequence",
                           "the scene's cache is not numbered, or --frames names one frame"});
    std::vector<FlickerRow> rows;
    Progress progress("flicker", 2 * shots.size() * m_contenders.size());
    for (const Shot& shot : shots)
      for (const Contender& c : m_contenders)
        for (const bool perFrame : {true, false}) {
          if (late())
            m_leftOut.push_back(
                {fmt::format("flicker, {}, {}, seed_per_frame = {}", shot.name, c.label, perFrame),
                 "the time budget was spent"});
          else
            measure(shot, c, perFrame, rows);
          progress.add(1);
        }
    return rows;
  }

 private:
  bool late() const { return m_watch.seconds() > m_plan.seconds && !m_plan.quick; }

  Shot still() {
    Shot shot{"still", {}, true, {}};
    ReferenceMaker maker = referenceOf(m_plan.frame);
    while (maker.image().pairs < 2)
      maker.addPair();
    for (int i = 0; i < m_plan.stillFrames; ++i) {
      shot.frames.push_back(m_plan.frame + i);
      shot.references.push_back(maker.image());
    }
    return shot;
  }

  Shot moving() {
    Shot shot{"moving", m_plan.moving, false, {}};
    const double share =
        kReferenceShare * m_plan.seconds / static_cast<double>(m_plan.moving.size());
    for (const std::int64_t frame : m_plan.moving) {
      const Stopwatch watch;
      ReferenceMaker maker = referenceOf(frame);
      // A frame that an earlier study made good enough is taken as it is.
      const bool found = maker.image().pairs >= 2;
      while (maker.image().pairs < 2 || (!found && watch.seconds() + maker.pairSeconds() < share))
        maker.addPair();
      shot.references.push_back(maker.image());
    }
    return shot;
  }

  ReferenceMaker referenceOf(std::int64_t frame) {
    const scene::SceneFile base = m_plan.scene.open();
    const SceneFacts facts = sceneFacts(base, frame);
    return {m_plan.scene.with(neutralSettings(base)),
            frame,
            m_plan.referenceName,
            referenceKey(base, frame, facts.mediumHash),
            m_plan.cacheFolder,
            m_plan.chunk};
  }

  void measure(const Shot& shot, const Contender& c, bool perFrame, std::vector<FlickerRow>& rows) {
    std::vector<std::string> sets = c.sets;
    sets.push_back(fmt::format("scene.seed_per_frame={}", perFrame));
    const scene::SceneFile scene = m_plan.scene.open(sets);
    std::vector<double> errors;
    for (int seed = 0; seed < m_plan.seeds; ++seed) {
      double sum = 0;
      image::Image before;
      for (std::size_t i = 0; i < shot.frames.size(); ++i) {
        image::Image now;
        if (!render(scene, shot, i, seed, c.label, now)) return;
        if (i > 0)
          sum += frameToFrameError(before, now, shot.references[i - 1], shot.references[i], kTotal);
        before = std::move(now);
      }
      errors.push_back(sum / static_cast<double>(shot.frames.size() - 1));
    }
    rows.push_back({shot.name, c.label, perFrame, static_cast<int>(shot.frames.size()) - 1,
                    meanEstimate(errors)});
  }

  bool render(const scene::SceneFile& scene, const Shot& shot, std::size_t i, int seed,
              const std::string& label, image::Image& out) {
    RenderJob job;
    job.scene = scene;
    job.frame = shot.frames[i];
    if (shot.still) job.request.cacheFrame = m_plan.frame;
    job.request.seed = scene.scene.integer("seed") + kSeedStride * (seed + 1);
    job.image = m_plan.runFolder / "flicker.exr";
    const RenderOutcome outcome = renderInChild(job);
    if (outcome.failed) {
      m_leftOut.push_back({"flicker of " + label, outcome.message});
      return false;
    }
    out = image::readExr(job.image).image;
    std::error_code ignored;
    fs::remove(job.image, ignored);
    return true;
  }

  const FlickerPlan& m_plan;
  std::vector<LeftOut>& m_leftOut;
  Stopwatch m_watch;
  std::vector<Contender> m_contenders;
};

}  // namespace

double frameToFrameError(const image::Image& a, const image::Image& b,
                         const ReferenceImage& referenceA, const ReferenceImage& referenceB,
                         std::size_t layer) {
  // One truth seen twice has no noise in its difference.
  const bool sameTruth = &referenceA == &referenceB || referenceA.pixels.channels()[0].pixels ==
                                                           referenceB.pixels.channels()[0].pixels;
  const Planes refA = referenceA.mean(layer), refB = referenceB.mean(layer);
  const Planes varA = referenceA.variance(layer), varB = referenceB.variance(layer);
  std::vector<std::vector<float>> moved(3), variance(3);
  Planes image;
  image::MeasureOptions options;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::string name =
        image::Image::channelName(layer == kTotal ? "" : kLayers[layer], std::string(1, "RGB"[c]));
    const auto pa = a.channel(name), pb = b.channel(name);
    for (std::size_t i = 0; i < pa.size(); ++i) {
      moved[c].push_back(pb[i] - pa[i] + refA[c][i]);
      variance[c].push_back(sameTruth ? 0.0f : varA[c][i] + varB[c][i]);
    }
    // With sameTruth, b - a + ref against ref leaves the difference of the frames alone.
    image.emplace_back(moved[c]);
    options.referenceVariance.emplace_back(variance[c]);
  }
  return image::measure(image, refB, a.width(), Vec2i(0), options).unbiasedRelMse;
}

std::vector<FlickerRow> measureFlicker(const FlickerPlan& plan, std::vector<LeftOut>& leftOut) {
  return FlickerMeter(plan, leftOut).run();
}

}  // namespace photosphere::study
