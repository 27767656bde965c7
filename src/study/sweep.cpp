#include "sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "photosphere/core/progress.h"
#include "photosphere/image/exr.h"
#include "photosphere/image/metrics.h"

namespace photosphere::study {

namespace fs = std::filesystem;

namespace {

/// The reference's noise may be this part of the best contender's error.
constexpr double kNoiseShare = 0.1;
/// Work of a level over that of the one before it.
constexpr double kLevelGrowth = 4;
/// Part of the budget that one contender may take, where the budget is worth sharing [s].
constexpr double kLargestShare = 0.25, kShortBudget = 30;
constexpr std::uint64_t kProgressParts = 1000;

std::array<Planes, 2> layersOf(const image::Image& image) {
  std::array<Planes, 2> layers;
  for (const char* letter : {"R", "G", "B"}) {
    layers[kTotal].push_back(image.channel(letter));
    layers[kMultiple].push_back(image.channel(std::string("multiple.") + letter));
  }
  return layers;
}

template <class Function>
Spread spreadOver(const std::vector<RenderOutcome>& runs, const Function& value) {
  std::vector<double> values;
  for (const RenderOutcome& run : runs)
    values.push_back(static_cast<double>(value(run)));
  return spreadOf(values);
}

// Colour alone: what this process keeps in memory, its children begin with.
image::Image pictureOf(const image::Image& frame) {
  image::Image picture(frame.width(), frame.height());
  for (const char* letter : {"R", "G", "B"}) {
    const auto from = frame.channel(letter);
    std::copy(from.begin(), from.end(), picture.addChannel(letter).begin());
  }
  return picture;
}

std::string settingsText(const std::vector<std::string>& sets) {
  return fmt::format("{}", fmt::join(sets, "; "));
}

}  // namespace

Sweep::Sweep(SweepPlan plan) : m_plan(std::move(plan)) {
  m_base = m_plan.scene.open();
  m_facts = sceneFacts(m_base, m_plan.frame);
  if (m_facts.bounds.empty())
    throw ConfigError(fmt::format("{}: there is no smoke at frame {}; nothing to study",
                                  m_plan.scene.path.string(), m_plan.frame));
  for (Contender& c : contenders(m_plan.scene, m_plan.size, m_plan.particleSets, m_leftOut)) {
    scene::SceneFile scene = m_plan.scene.open(c.sets);
    m_entries.push_back({std::move(c), std::move(scene), {}, {}, false});
  }
  m_reference.emplace(m_plan.scene.with(neutralSettings(m_base)), m_plan.frame,
                      m_plan.referenceName, referenceKey(m_base, m_plan.frame, m_facts.mediumHash),
                      m_plan.cacheFolder, m_plan.chunk);
}

void Sweep::leaveOut(Entry& entry, const std::string& why) {
  entry.dropped = true;
  m_leftOut.push_back({entry.contender.label, why});
  log::info("{}: left out: {}", entry.contender.label, why);
}

void Sweep::run(Entry& entry, int seed) {
  RenderJob job;
  job.scene = entry.scene;
  job.frame = m_plan.frame;
  job.request.seed = m_base.scene.integer("seed") + seed;
  const auto index = static_cast<std::size_t>(&entry - m_entries.data());
  job.image = m_plan.runFolder / fmt::format("{}-{}-{}.exr", fileStem(m_plan.name), index, seed);
  const RenderOutcome outcome = renderInChild(job);
  if (outcome.failed) {
    leaveOut(entry, outcome.message);
    return;
  }
  entry.runs.push_back(outcome);
  entry.images.push_back(job.image);
}

// Whether a contender's seeds fit what the budget leaves beside the further seeds of those
// measured.
bool Sweep::affordable(const Entry& entry, double elapsed, double& predicted) const {
  predicted = 0;
  double before = 0;  // of the level before the last; what does not grow cancels in the difference
  for (const Entry& other : m_entries) {
    if (other.contender.family != entry.contender.family || other.runs.empty()) continue;
    const double last = other.runs[0].seconds.total;
    predicted =
        before > 0 ? last + kLevelGrowth * std::max(0.0, last - before) : kLevelGrowth * last;
    before = last;
  }
  if (predicted == 0) return true;
  const double committed = secondsOfRound() * (m_plan.seeds - 1);
  return elapsed + committed + predicted * m_plan.seeds <= m_plan.measureSeconds;
}

double Sweep::secondsOfRound() const {
  double sum = 0;
  for (const Entry& entry : m_entries)
    if (!entry.dropped && !entry.runs.empty()) sum += entry.runs[0].seconds.total;
  return sum;
}

// The least work of a family cannot be foretold: one that alone would take much of the budget goes.
void Sweep::tryOut(Entry& entry) {
  run(entry, 0);
  if (entry.dropped || m_plan.measureSeconds < kShortBudget) return;
  const double all = entry.runs[0].seconds.total * m_plan.seeds;
  if (all > kLargestShare * m_plan.measureSeconds)
    leaveOut(entry, fmt::format("its {} runs would take {:.3g} s of the {:.3g} s for all",
                                m_plan.seeds, all, m_plan.measureSeconds));
}

void Sweep::measureFirst(const Stopwatch& watch) {
  Progress progress(m_plan.name + ": try", m_entries.size());
  for (Entry& entry : m_entries) {
    const auto failed = [&](const Entry& other) {
      return other.dropped && other.contender.family == entry.contender.family;
    };
    double predicted = 0;
    if (std::any_of(m_entries.begin(), m_entries.end(), failed))
      leaveOut(entry, "less work of the same family was left out already");
    else if (!affordable(entry, watch.seconds(), predicted))
      leaveOut(entry, fmt::format("its {} runs of about {:.3g} s would pass the time budget",
                                  m_plan.seeds, predicted));
    else
      tryOut(entry);
    progress.add(1);
  }
}

void Sweep::measure() {
  std::error_code ignored;
  fs::create_directories(m_plan.runFolder, ignored);
  const ChildResult start = runInChild([] { return std::to_string(peakMemoryBytes()); });
  if (!start.failed) m_startMemory = std::stoull(start.text);
  const Stopwatch watch;
  measureFirst(watch);
  const double round = secondsOfRound();
  Progress progress(m_plan.name + ": measure", kProgressParts);
  double done = 0;
  std::uint64_t reported = 0;
  for (int seed = 1; seed < m_plan.seeds; ++seed)
    for (std::size_t i = 0; i < m_entries.size(); ++i) {
      // To and fro: slow minutes of the machine then fall on all contenders alike.
      Entry& entry = m_entries[seed % 2 ? m_entries.size() - 1 - i : i];
      if (entry.dropped) continue;
      done += entry.runs[0].seconds.total;
      run(entry, seed);
      const auto part = static_cast<std::uint64_t>(done / (round * (m_plan.seeds - 1)) *
                                                   static_cast<double>(kProgressParts));
      progress.add(part - std::exchange(reported, part));
    }
}

std::array<double, 2> Sweep::bestErrors() const {
  const ReferenceImage& reference = m_reference->image();
  std::array<double, 2> best{1e300, 1e300};
  for (const Entry& entry : m_entries) {
    if (entry.dropped || entry.images.empty()) continue;
    const image::Image frame = image::readExr(entry.images.front()).image;
    const auto layers = layersOf(frame);
    for (std::size_t layer = 0; layer < kLayers.size(); ++layer) {
      image::MeasureOptions options;
      options.referenceVariance = reference.variance(layer);
      const double error =
          image::measure(layers[layer], reference.mean(layer), frame.width(), Vec2i(0), options)
              .unbiasedRelMse;
      best[layer] = std::min(best[layer], std::max(0.0, error));
    }
  }
  return best;
}

std::array<double, 2> Sweep::pathNoise() const {
  std::array<double, 2> noise{};
  const ReferenceImage& reference = m_reference->image();
  const Entry* path = nullptr;
  for (const Entry& entry : m_entries)
    if (!entry.dropped && entry.images.size() >= 2 &&
        entry.contender.family->name == reference.method)
      path = &entry;  // levels ascend: the last has the most samples
  if (!path || reference.empty()) return noise;
  std::vector<image::Image> frames;
  for (const fs::path& file : path->images)
    frames.push_back(image::readExr(file).image);
  for (std::size_t layer = 0; layer < kLayers.size(); ++layer) {
    std::vector<Planes> seeds;
    for (const image::Image& frame : frames)
      seeds.push_back(layersOf(frame)[layer]);
    const double variance =
        errorFigures(seeds, reference.mean(layer), reference.variance(layer), {}).variance.value;
    noise[layer] = variance * static_cast<double>(path->contender.work) /
                   static_cast<double>(reference.samples);
  }
  return noise;
}

double Sweep::stillNeeded(const std::array<double, 2>& best) const {
  const ReferenceImage& reference = m_reference->image();
  if (reference.pairs < 2) return 2;  // a variance from one pair alone says too little
  // Outliers of the reference hide in their own denominators: the worse estimate counts.
  auto noise = reference.noise();
  const auto spread = pathNoise();
  double factor = 0;
  for (std::size_t layer = 0; layer < kLayers.size(); ++layer)
    if (noise[layer] = std::max(noise[layer], spread[layer]); noise[layer] > 0)
      factor = std::max(factor, best[layer] > 0 ? noise[layer] / (kNoiseShare * best[layer]) : 4.0);
  return factor;
}

namespace {

// The best errors against what a reference was at some time.
struct Look {
  std::uint64_t pairs = 0;
  std::array<double, 2> best{};
};

// Paths of which few bring nearly all the light leave most pixels of a young reference too dark,
// and every contender far off: so far that its noise looks small beside that. It has its worth once
// twice as many paths show the contenders no better.
bool settled(const std::vector<Look>& looks) {
  constexpr std::uint64_t kGrown = 16;  // pairs: taken at their word when they were here before
  constexpr double kSteady = 0.8;
  const Look& now = looks.back();
  if (looks.front().pairs >= kGrown) return true;
  const Look* before = nullptr;
  for (const Look& look : looks)
    if (2 * look.pairs <= now.pairs) before = &look;
  for (std::size_t layer = 0; before && layer < kLayers.size(); ++layer)
    if (now.best[layer] < kSteady * before->best[layer]) return false;
  return before != nullptr;
}

}  // namespace

void Sweep::refine() {
  const Stopwatch watch;
  Progress progress(m_plan.name + ": reference", kProgressParts);
  std::uint64_t reported = 0;
  const ReferenceImage& image = m_reference->image();
  std::vector<Look> looks;
  while (true) {
    if (image.pairs > 0) looks.push_back({image.pairs, bestErrors()});
    double factor = looks.empty() ? 2 : stillNeeded(looks.back().best);
    m_quiet = factor <= 1;
    m_settled = !looks.empty() && settled(looks);
    if (m_quiet && m_settled) return;
    factor = std::max(factor, 1.01);
    const double needed = factor * static_cast<double>(std::max<std::uint64_t>(1, image.pairs));
    // Look again after a quarter more samples: looking costs time as well.
    const auto lookAt = static_cast<std::uint64_t>(
        std::max(static_cast<double>(image.pairs) + 1,
                 std::min(needed, 1.25 * static_cast<double>(image.pairs))));
    while (image.pairs < lookAt) {
      const bool late = watch.seconds() + m_reference->pairSeconds() > m_plan.referenceSeconds;
      if (late && image.pairs >= 2) return;
      m_reference->addPair();
      const double share = std::min(1.0, static_cast<double>(image.pairs) / needed);
      const auto part = static_cast<std::uint64_t>(share * static_cast<double>(kProgressParts));
      if (part > reported) progress.add(part - std::exchange(reported, part));
    }
  }
}

// Whether no other contender of its family did more work: only those are shown.
bool Sweep::strongest(const Entry& entry) const {
  return std::none_of(m_entries.begin(), m_entries.end(), [&](const Entry& other) {
    return !other.dropped && !other.runs.empty() &&
           other.contender.family == entry.contender.family &&
           other.contender.work > entry.contender.work;
  });
}

PointResult Sweep::evaluate(const Entry& entry,
                            const std::optional<std::vector<unsigned char>>& smoke) const {
  PointResult point;
  point.family = entry.contender.family->name;
  point.label = entry.contender.label;
  point.settings = settingsText(entry.contender.sets);
  point.work = entry.contender.work;
  point.seeds = static_cast<int>(entry.runs.size());
  const auto seconds = [&](double scene::StageSeconds::*stage) {
    return spreadOver(entry.runs, [&](const RenderOutcome& r) { return r.seconds.*stage; });
  };
  using S = scene::StageSeconds;
  point.seconds = {seconds(&S::read),    seconds(&S::rasterize), seconds(&S::trace),
                   seconds(&S::resolve), seconds(&S::march),     seconds(&S::total)};
  point.cpuSeconds = spreadOver(entry.runs, [](const RenderOutcome& r) { return r.cpuSeconds; });
  point.peakMemoryBytes =
      spreadOver(entry.runs, [](const RenderOutcome& r) { return r.peakMemoryBytes; });
  point.photonsStored = entry.runs.front().photonsStored;
  point.lightMemoryBytes = entry.runs.front().lightMemoryBytes;
  point.estimatedError =
      spreadOver(entry.runs, [](const RenderOutcome& r) { return r.estimatedError; });
  std::vector<image::Image> frames;
  for (const fs::path& path : entry.images)
    frames.push_back(image::readExr(path).image);
  for (std::size_t layer = 0; layer < kLayers.size(); ++layer) {
    std::vector<Planes> seeds;
    for (const image::Image& frame : frames)
      seeds.push_back(layersOf(frame)[layer]);
    const ReferenceImage& r = m_reference->image();
    point.errors[layer][kAllPixels] = errorFigures(seeds, r.mean(layer), r.variance(layer), {});
    if (smoke)
      point.errors[layer][kSmokeOnly] =
          errorFigures(seeds, r.mean(layer), r.variance(layer), *smoke);
  }
  if (strongest(entry)) point.frame = pictureOf(frames.front());
  return point;
}

SweepResult Sweep::evaluate() const {
  SweepResult result;
  result.name = m_plan.name;
  result.description = m_plan.description;
  result.sets = m_plan.scene.sets;
  result.width = m_facts.width;
  result.height = m_facts.height;
  result.startMemoryBytes = m_startMemory;
  result.leftOut = m_leftOut;
  const ReferenceImage& reference = m_reference->image();
  result.reference = {m_reference->key(),
                      reference.method,
                      m_reference->origin(),
                      m_reference->samplesBefore(),
                      reference.samples,
                      m_reference->seconds(),
                      reference.noise(),
                      pathNoise(),
                      m_quiet,
                      m_settled};
  result.referenceImage = reference.pixels;
  const auto smoke = image::smokeMask(reference.pixels);
  // Family by family, where the entries go level by level.
  for (const Family& family : families())
    for (const Entry& entry : m_entries)
      if (entry.contender.family == &family && !entry.dropped && !entry.runs.empty())
        result.points.push_back(evaluate(entry, smoke));
  std::error_code ignored;
  for (const Entry& entry : m_entries)
    for (const fs::path& path : entry.images)
      fs::remove(path, ignored);
  return result;
}

}  // namespace photosphere::study
