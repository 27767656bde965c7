// The table of hard cases: catalogue in, rows out.

#include "photosphere/study/stability.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "child.h"
#include "machine.h"
#include "photosphere/core/error.h"
#include "photosphere/core/hash.h"
#include "stability_catalogue.h"
#include "stability_frame.h"
#include "stability_slabs.h"
#include "stability_smoke.h"
#include "stability_traces.h"

namespace photosphere::study {

namespace fs = std::filesystem;

namespace {

using Sets = std::vector<std::string>;

constexpr double kCpuLimit = 120, kQuickCpuLimit = 30;  // seconds a run
constexpr int kFiner = 10;
constexpr int kQuickShare = 24;  // of the small size: paths held against are so many times fewer

void append(Sets& to, const Sets& more) {
  to.insert(to.end(), more.begin(), more.end());
}

// Lamps in place of the scene's one, with its light in equal parts: at its place, or in a cube
// about it.
void shareLight(scene::SceneFile& scene, int lamps, double spread) {
  if (lamps < 2) return;
  scene::LightEntry part = scene.lights.front();
  part.values.set("intensity", part.values.real("intensity") / lamps, part.where);
  scene.lights.assign(static_cast<std::size_t>(lamps), part);
  if (spread == 0) return;
  // Roberts' sequence: multiples of the powers of 1/g, g^4 = g + 1, fill a cube evenly.
  const Vec3d steps(0.81917251339616443, 0.67104360670378920, 0.54970047790197026);
  const Vec3d place = part.values.vec3("position");
  for (int i = 0; i < lamps; ++i) {
    const Vec3d p =
        place + spread * (glm::fract(Vec3d(0.5) + steps * static_cast<double>(i + 1)) - Vec3d(0.5));
    scene.lights[static_cast<std::size_t>(i)].values.set(
        "position", std::vector<double>{p.x, p.y, p.z}, part.where);
  }
}

std::string numberText(double value) {
  return fmt::format("{:.6g}", value);
}

class Table {
 public:
  Table(const StabilityOptions& options, const std::function<void(const StabilityRow&)>& each)
      : m_options(options),
        m_each(each),
        m_catalogue(readStabilityCatalogue(options.catalogue.empty() ? shippedStabilityCatalogue()
                                                                     : options.catalogue)),
        m_folder(fs::temp_directory_path() / fmt::format("photosphere-hard-{}", getpid())) {
    checkNames();
    if (m_options.quick)
      for (StabilityCase& c : m_catalogue.cases)
        append(c.set, c.quickSet);
  }

  std::vector<StabilityRow> run() {
    for (const StabilityCase& c : m_catalogue.cases) {
      if (!chosen(c) || (m_options.quick && !c.quick)) continue;
      m_frames.clear();
      if (c.trace == "slab_radiance") {
        runSlabRadiance(c);
      } else if (!c.trace.empty()) {
        runTrace(c);
      } else {
        const std::vector<const StabilityEstimator*> estimators = estimatorsOf(c);
        if (estimators.empty() && m_options.estimators.empty())
          throw ConfigError(fmt::format("{}: no estimator renders it in this size", c.name));
        for (const StabilityEstimator* e : estimators)
          runFrame(c, *e);
      }
    }
    return std::move(m_rows);
  }

 private:
  template <class Matches>
  bool anyChoice(const Matches& matches) const {
    return m_options.cases.empty() ||
           std::any_of(m_options.cases.begin(), m_options.cases.end(), matches);
  }
  bool chosen(const StabilityCase& c) const {
    return anyChoice([&](const std::string& begin) { return beginsRow(c, begin); });
  }

  // The name of a slab's row.
  static std::string nameOf(const StabilityCase& c, const SlabRadiance& slab) {
    return fmt::format("{}_tau{:g}_albedo{:g}", c.name, slab.tau, slab.albedo);
  }
  // Whether a row of the case has a name that begins so.
  static bool beginsRow(const StabilityCase& c, const std::string& begin) {
    if (c.name.starts_with(begin)) return true;
    if (c.trace != "slab_radiance" || !begin.starts_with(c.name)) return false;
    const std::vector<SlabRadiance> slabs = slabRadiances(c.slab.number("g", 0), false);
    return std::any_of(slabs.begin(), slabs.end(), [&](const SlabRadiance& slab) {
      return nameOf(c, slab).starts_with(begin);
    });
  }

  // A name that nothing has would pass by testing nothing.
  void checkNames() const {
    const auto known = [&](const std::string& name) {
      return std::any_of(m_catalogue.estimators.begin(), m_catalogue.estimators.end(),
                         [&](const StabilityEstimator& e) { return e.name == name; });
    };
    const auto refuse = [](const std::string& where, const std::string& name) {
      throw ConfigError(
          fmt::format("{}: no estimator of the catalogue is named '{}'", where, name));
    };
    for (const std::string& name : m_options.estimators)
      if (!known(name)) refuse("--family", name);
    for (const StabilityCase& c : m_catalogue.cases) {
      for (const Sets* names : {&c.estimators, &c.quickEstimators})
        for (const std::string& name : *names)
          if (!known(name)) refuse(c.name, name);
      for (const auto& [name, bound] : c.bounds)
        if (!known(name)) refuse(c.name, name);
    }
    for (const std::string& begin : m_options.cases)
      if (std::none_of(m_catalogue.cases.begin(), m_catalogue.cases.end(),
                       [&](const StabilityCase& c) { return beginsRow(c, begin); }))
        throw ConfigError(fmt::format("--case {}: no hard case has a name that begins so", begin));
  }

  std::vector<const StabilityEstimator*> estimatorsOf(const StabilityCase& c) const {
    const auto holds = [](const Sets& names, const std::string& name) {
      return std::find(names.begin(), names.end(), name) != names.end();
    };
    const bool ownQuick = m_options.quick && !c.quickEstimators.empty();
    const Sets& named = ownQuick ? c.quickEstimators : c.estimators;
    std::vector<const StabilityEstimator*> out;
    for (const StabilityEstimator& e : m_catalogue.estimators) {
      const bool taken = named.empty() ? e.always : holds(named, e.name);
      const bool small = !m_options.quick || ownQuick || e.quick;
      const bool asked = m_options.estimators.empty() || holds(m_options.estimators, e.name);
      if (taken && small && asked) out.push_back(&e);
    }
    return out;
  }

  StabilityRow rowOf(const StabilityCase& c, const std::string& estimator) const {
    StabilityRow row;
    row.kind = c.kind;
    row.name = c.name;
    row.estimator = estimator;
    row.hard = c.hard;
    row.oracle = c.oracle.source.empty() ? c.oracle.kind : c.oracle.source;
    row.bound = c.boundOf(estimator, m_options.quick);
    return row;
  }

  void finish(StabilityRow row) {
    // The folder is gone with the run.
    const std::string folder = m_folder.path().string() + '/';
    for (std::size_t at = row.message.find(folder); at != std::string::npos;
         at = row.message.find(folder, at))
      row.message.erase(at, folder.size());
    if (m_each) m_each(row);
    m_rows.push_back(std::move(row));
  }

  // The smoke of a spec, made when first asked for.
  std::string smokeFile(SmokeSpec spec) {
    // Sizes that only the full table has.
    for (const char* name : {"points", "voxels"}) {
      const std::string full = std::string("full_") + name;
      if (!m_options.quick && spec.numbers.contains(full)) spec.numbers[name] = spec.numbers[full];
      spec.numbers.erase(full);
    }
    Hasher hasher;
    hasher.text(spec.key());
    const fs::path path = m_folder.path() / (hasher.hex() + ".vdb");
    if (fs::exists(path)) return path.string();
    const ChildResult made = runInChild([&] {
      writeStabilitySmoke(spec, path);
      return std::string();
    });
    if (made.failed) throw Error(made.code, "smoke for a hard case: " + made.message);
    return path.string();
  }

  // The base scene over a smoke, with settings; `$smoke` stands for the file.
  scene::SceneFile sceneWith(const std::string& smoke, Sets sets) const {
    for (std::string& set : sets)
      for (std::size_t at = set.find("$smoke"); at != std::string::npos; at = set.find("$smoke"))
        set.replace(at, 6, smoke);
    sets.insert(sets.begin(), fmt::format("volume.0.file=\"{}\"", smoke));
    return scene::parseScene(m_catalogue.scene, (m_catalogue.folder / "base.toml").string(),
                             m_catalogue.folder, sets);
  }

  bool onlyRuns() const { return m_options.work < 1; }

  void doLess(scene::SceneFile& scene) const {
    const auto less = [&](ParamValues& values, const char* key) {
      values.set(key,
                 std::max(std::int64_t{1},
                          static_cast<std::int64_t>(std::llround(
                              static_cast<double>(values.integer(key)) * m_options.work))),
                 "less work");
    };
    for (const char* key : {"photons", "samples", "final_gather"})
      less(scene.estimator, key);
    less(scene.render, "samples");
  }

  // A row of which nothing but its end is known.
  static void tellEnd(const StabilityFrame& frame, StabilityRow& row) {
    row.expected = "an end";
    row.result = frame.failed ? fmt::format("exit {}", static_cast<int>(frame.code))
                              : numberText(meanOf(frame));
    row.message = frame.message;
    row.passed = !(frame.failed && frame.code == ExitCode::unspecified) && row.nanSamples == 0 &&
                 row.negativeSamples == 0;
    judgeMajorants(frame.majorantViolations, row);
  }

  StabilityFrameJob jobOf(const StabilityCase& c, const SmokeSpec& smoke, const Sets& sets,
                          int lamps) {
    StabilityFrameJob job;
    job.scene = sceneWith(smokeFile(smoke), sets);
    job.scene.allowInvalid = c.allowInvalid;
    shareLight(job.scene, lamps, c.spread);
    if (c.crop.size() == 4)
      job.request.crop = render::Crop{{c.crop[0], c.crop[1]}, {c.crop[2], c.crop[3]}};
    job.layer = c.layer;
    job.cpuLimit = m_options.quick ? kQuickCpuLimit : kCpuLimit;
    if (onlyRuns()) {
      doLess(job.scene);
      job.cpuLimit = kCpuLimit * kFiner;
    }
    return job;
  }

  static void makeFiner(scene::SceneFile& scene) {
    for (const char* key : {"photons", "samples", "final_gather"})
      scene.estimator.set(key, scene.estimator.integer(key) * kFiner, "finer");
    scene.render.set("samples", scene.render.integer("samples") * kFiner, "finer");
    scene.scene.set("seed", scene.scene.integer("seed") + 1, "finer");
  }

  // The pixels of a whole frame that a crop keeps.
  static StabilityFrame cut(const StabilityFrame& whole, const std::vector<int>& crop) {
    StabilityFrame part = whole;
    const int left = std::max(crop[0], 0), right = std::min(crop[2], whole.width);
    const int top = std::max(crop[1], 0), bottom = std::min(crop[3], whole.height);
    part.width = std::max(0, right - left);
    part.height = std::max(0, bottom - top);
    part.pixels.clear();
    for (int y = top; y < bottom; ++y)
      for (int x = left; x < right; ++x)
        for (int channel = 0; channel < 3; ++channel)
          part.pixels.push_back(
              whole.pixels[static_cast<std::size_t>(3 * (y * whole.width + x) + channel)]);
    return part;
  }

  // What the frame is held against, rendered once for all that ask for the same. A crop is held
  // against that part of the whole frame.
  const StabilityFrame& reference(const StabilityCase& c, const StabilityEstimator& e,
                                  const StabilityOracle& o) {
    Sets sets;
    if (o.kind != "same" || !o.bare) sets = c.set;
    if (o.kind == "path") {
      append(sets, e.truth);
      append(sets, {"estimator.type=\"path_traced\"", "scene.seed=77",
                    fmt::format("estimator.samples={}", (o.samples > 0 ? o.samples : 2048) /
                                                            (m_options.quick ? kQuickShare : 1))});
    } else {
      append(sets, e.set);
    }
    append(sets, o.set);
    const SmokeSpec& smoke = o.ownSmoke ? o.smoke : c.smoke;
    const int lamps = o.kind == "same" ? 0 : c.lights;
    std::string key = fmt::format("{} {} lamps in {} {}", o.kind, lamps, c.spread, smoke.key());
    for (const std::string& set : sets)
      key += "\n" + set;
    const auto known = m_frames.find(key);
    if (known != m_frames.end()) return known->second;
    StabilityFrameJob job = jobOf(c, smoke, sets, lamps);
    job.request.crop.reset();
    if (o.kind == "finer") makeFiner(job.scene);
    job.cpuLimit *= kFiner;
    StabilityFrame frame = renderStabilityFrame(job);
    if (c.crop.size() == 4 && !frame.failed) frame = cut(frame, c.crop);
    return m_frames.emplace(key, std::move(frame)).first->second;
  }

  void runFrame(const StabilityCase& c, const StabilityEstimator& e) {
    StabilityRow row = rowOf(c, e.name);
    try {
      Sets sets = c.set;
      append(sets, e.set);
      StabilityFrameJob job = jobOf(c, c.smoke, sets, c.lights);
      job.seeds = c.seeds;
      job.writes = c.writes;
      job.exr = m_folder.path() / "frame.exr";
      const StabilityFrame frame = renderStabilityFrame(job);
      row.seconds = frame.seconds;
      row.nanSamples = frame.nanSamples;
      row.negativeSamples = frame.negativeSamples;
      row.cappedPower = frame.cappedShare;
      judge(c, e, frame, row);
    } catch (const InterruptedError&) {
      throw;
    } catch (const ConfigError& error) {
      // Scenes are read here: what they say wrong may be what is asked for.
      StabilityFrame refused;
      refused.failed = true;
      refused.code = error.code();
      refused.message = error.what();
      judge(c, e, refused, row);
    }
    finish(std::move(row));
  }

  void judge(const StabilityCase& c, const StabilityEstimator& e, const StabilityFrame& frame,
             StabilityRow& row) {
    if (onlyRuns()) return tellEnd(frame, row);
    if (c.oracle.kind == "error")
      return judgeRefusal(c, frame.failed, frame.code, frame.message, row);
    if (frame.failed) {
      row.message = frame.message;
      row.error = std::numeric_limits<double>::infinity();
      return;
    }
    row.result = numberText(meanOf(frame));
    if (c.oracle.kind == "zero") {
      row.expected = "0";
      row.error =
          std::any_of(frame.pixels.begin(), frame.pixels.end(), [](double v) { return v != 0; })
              ? 1
              : 0;
    } else if (c.oracle.kind == "below") {
      row.expected = fmt::format("< {:g}", c.oracle.value);
      for (const double v : frame.pixels)
        row.error = std::isfinite(v) ? std::max(row.error, std::abs(v) / c.oracle.value)
                                     : std::numeric_limits<double>::infinity();
      if (!(meanOf(frame) >= c.oracle.least)) row.error = std::numeric_limits<double>::infinity();
      if (c.oracle.least > 0) row.expected += fmt::format(", mean >= {:g}", c.oracle.least);
    } else if (c.oracle.kind == "value") {
      StabilityFrame flat = frame;
      std::fill(flat.pixels.begin(), flat.pixels.end(), c.oracle.value);
      hold(c, frame, flat, row);
    } else if (c.oracle.kind == "finer" || c.oracle.kind == "path" || c.oracle.kind == "same") {
      const StabilityFrame& other = reference(c, e, c.oracle);
      if (other.failed) {
        row.message = "what it is held against failed: " + other.message;
        return;
      }
      hold(c, frame, other, row);
      tellTruth(c, e, frame, row);
    } else {
      throw ConfigError(fmt::format("{}: no oracle is of kind '{}'", c.name, c.oracle.kind));
    }
    row.passed = row.error <= row.bound && frame.nanSamples == 0 && frame.negativeSamples == 0;
    judgeWords(c, frame, row);
  }

  // One more count against a row.
  static void fail(StabilityRow& row, const std::string& why) {
    row.passed = false;
    row.message += (row.message.empty() ? "" : "; ") + why;
  }

  static void judgeMajorants(std::uint64_t violations, StabilityRow& row) {
    if (violations > 0) fail(row, fmt::format("{} majorants exceeded", violations));
  }

  static void judgeWords(const StabilityCase& c, const StabilityFrame& frame, StabilityRow& row) {
    judgeMajorants(frame.majorantViolations, row);
    if (!c.writes.empty() && frame.fileType != c.writes)
      fail(row, fmt::format("the file holds {}, not {}", frame.fileType, c.writes));
    if (frame.notes.find(c.says) == std::string::npos)
      fail(row, fmt::format("no note says '{}', but: {}", c.says, frame.notes));
  }

  static double errorOf(const StabilityCase& c, const StabilityFrame& frame,
                        const StabilityFrame& other, double scale) {
    return c.metric == "mean" ? meanError(frame, other, scale)
                              : frameError(frame, other, c.block, scale);
  }

  static void hold(const StabilityCase& c, const StabilityFrame& frame, const StabilityFrame& other,
                   StabilityRow& row) {
    const double scale = c.oracle.scale;
    row.expected = numberText(meanOf(other) * scale);
    row.error = errorOf(c, frame, other, scale);
  }

  // More work of the same kind does not show what it converges to: said, not judged.
  void tellTruth(const StabilityCase& c, const StabilityEstimator& e, const StabilityFrame& frame,
                 StabilityRow& row) {
    if (c.oracle.kind != "finer" || c.oracle.samples == 0 || m_options.quick) return;
    StabilityOracle truth;
    truth.kind = "path";
    truth.samples = c.oracle.samples;
    const StabilityFrame& paths = reference(c, e, truth);
    row.message = paths.failed
                      ? "path tracing failed: " + paths.message
                      : fmt::format("path tracing has {}: relative error {:.2g}",
                                    numberText(meanOf(paths)), errorOf(c, frame, paths, 1));
  }

  void runTrace(const StabilityCase& c) {
    if (!m_options.estimators.empty()) return;
    StabilityRow row = rowOf(c, "-");
    StabilityCase part = c;
    if (onlyRuns())
      for (const char* key : {"photons", "quick_photons"})
        if (c.slab.numbers.contains(key))
          part.slab.numbers[key] = {
              std::max(1.0, std::round(c.slab.number(key, 0) * m_options.work))};
    runStabilityTrace(part, m_options.quick, row);
    // What came to an end of its own has a result.
    if (onlyRuns())
      row.passed = !row.result.empty() && !tellsOfDeath(row.message) && row.nanSamples == 0;
    finish(std::move(row));
  }

  void runSlabRadiance(const StabilityCase& c) {
    std::vector<SlabRadiance> slabs = slabRadiances(c.slab.number("g", 0), m_options.quick);
    std::erase_if(slabs, [&](const SlabRadiance& slab) {
      return !anyChoice(
          [&](const std::string& begin) { return nameOf(c, slab).starts_with(begin); });
    });
    for (const StabilityEstimator* e : estimatorsOf(c))
      for (const SlabRadiance& slab : slabs)
        runSlab(c, *e, slab);
  }

  // The worst direction of one slab.
  void runSlab(const StabilityCase& c, const StabilityEstimator& e, const SlabRadiance& slab) {
    StabilityRow row = rowOf(c, e.name);
    row.name = nameOf(c, slab);
    std::uint64_t violations = 0;
    for (const SlabRadiance::Direction& d : slab.directions) {
      // Where few photons leave, as the frame itself tells, more are traced.
      StabilityFrame frame;
      bool more = true;
      for (std::size_t effort = 0; more; ++effort) {
        Sets sets = c.set;
        append(sets, slab.settings(d, effort));
        append(sets, e.set);
        frame = renderStabilityFrame(jobOf(c, slab.smoke(), sets, 0));
        row.seconds += frame.seconds;
        row.nanSamples += frame.nanSamples;
        row.negativeSamples += frame.negativeSamples;
        violations += frame.majorantViolations;
        more = !onlyRuns() && !frame.failed && effort < SlabRadiance::kDim.size() &&
               meanOf(frame) < SlabRadiance::kDim[effort];
      }
      if (onlyRuns()) {
        tellEnd(frame, row);
        return finish(std::move(row));
      }
      if (frame.failed) {
        fail(row, frame.message);
        return finish(std::move(row));
      }
      const double error = std::abs(meanOf(frame) / d.value - 1);
      // What is not a number is worse than any error.
      if (!row.result.empty() && (std::isnan(row.error) || error <= row.error)) continue;
      row.error = error;
      row.expected = numberText(d.value);
      row.result = numberText(meanOf(frame));
      row.message =
          fmt::format("worst at {} mu {:g}", d.top ? "the lit face," : "the far face,", d.mu);
    }
    row.passed = row.error <= row.bound && row.nanSamples + row.negativeSamples == 0;
    judgeMajorants(violations, row);
    finish(std::move(row));
  }

  const StabilityOptions& m_options;
  const std::function<void(const StabilityRow&)>& m_each;
  StabilityCatalogue m_catalogue;
  RunFolder m_folder;
  std::map<std::string, StabilityFrame> m_frames;  // of one case
  std::vector<StabilityRow> m_rows;
};

}  // namespace

std::vector<StabilityRow> runStability(const StabilityOptions& options,
                                       const std::function<void(const StabilityRow&)>& each) {
  return Table(options, each).run();
}

}  // namespace photosphere::study
