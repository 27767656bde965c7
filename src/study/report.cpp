// The page: one HTML file that needs nothing beside it.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "advice.h"
#include "curves.h"
#include "html.h"
#include "photosphere/core/output_file.h"
#include "photosphere/core/resources.h"
#include "photosphere/study/study.h"
#include "pictures.h"
#include "plots.h"
#include "report_tables.h"
#include "tables.h"

namespace photosphere::study {

namespace {

std::string heading(int level, const std::string& text) {
  return fmt::format("<h{0}>{1}</h{0}>\n", level, escape(text));
}

std::string paragraph(const std::string& text) {
  return "<p>" + escape(text) + "</p>\n";
}

std::string figure(const std::string& content, const std::string& caption) {
  return fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", content, escape(caption));
}

std::string introduction(const StudyResult& r) {
  const SweepResult& main = r.sweeps.front();
  std::string text = paragraph(fmt::format(
      "{}, frame {}, {} x {} pixels; {} on {} threads of {}; begun {} UTC, took {:.0f} s of about "
      "{:.0f} s allowed{}.",
      r.scene, r.frame, main.width, main.height, r.version, r.threads, r.machine, r.date,
      r.elapsedSeconds, 60 * r.minutes,
      r.quick ? ". QUICK: tiny frames and little work; nothing here says how good anything is"
              : ""));
  text += paragraph(fmt::format(
      "Every run is a process of its own; starting and ending one that does nothing takes {:.3g} s "
      "and {}, which the seconds below leave out and the memory below holds. The runs of all "
      "contenders take turns, so that slow minutes of the machine fall on all alike.",
      r.startSeconds.median, formatBytes(r.startMemoryBytes)));
  return text;
}

std::string definitions() {
  return heading(2, "How to read the figures") +
         paragraph(
             "relMSE is the mean over pixels and R, G, B of d^2 / (ref^2 + (0.1 mean ref)^2), with "
             "d "
             "the difference from the reference; relative error is its root. Layer multiple is "
             "light "
             "scattered twice or more, layer total the whole picture. Smoke only are pixels whose "
             "reference transmittance is below 0.99. The reference is made of paths from the "
             "eye or from the lamps, whichever is quieter, in pairs of independent halves; what "
             "its own noise adds is subtracted, so that a value may come "
             "out slightly below 0.") +
         paragraph(
             "Bias and variance come from independent seeds: variance is what differs between "
             "them, "
             "bias\u00b2 what they share (products of the errors of different seeds, in which "
             "their "
             "noise cancels). Intervals of relMSE and of the mean are Student's t over the seeds, "
             "those of bias\u00b2 and variance t intervals of jackknife pseudo-values; noise of "
             "the "
             "reference beyond its expectation is not in them.");
}

std::string sweepPlots(const SweepResult& sweep, const std::string& id) {
  std::string text;
  for (const std::size_t layer : {kMultiple, kTotal}) {
    const std::vector<Curve> curves = curvesOf(sweep, layer, kAllPixels);
    text += figure(
        errorPlot(curves, fmt::format("{}: layer {}, all pixels", sweep.name, kLayers[layer]),
                  fmt::format("{}{}", id, kLayers[layer]), 1000, 560),
        "Both axes are logarithmic; down and left is better. Bars: range of the times, "
        "95 % interval of the error. Ringed points are the Pareto front: nothing "
        "measured is both faster and better.");
  }
  return text;
}

std::string comparisonTables(const SweepResult& sweep) {
  std::string text;
  for (const std::size_t layer : {kMultiple, kTotal}) {
    const std::vector<Curve> curves = curvesOf(sweep, layer, kAllPixels);
    text += heading(3, fmt::format("Layer {}, all pixels", kLayers[layer]));
    for (const Table& table :
         {equalTimeTable(curves), equalErrorTable(curves), crossoverTable(curves)})
      text += tableTag(table);
  }
  return text;
}

std::string errorTables(const SweepResult& sweep) {
  std::string text;
  for (const std::size_t layer : {kMultiple, kTotal})
    for (const std::size_t region : {kAllPixels, kSmokeOnly})
      text += tableTag(errorTable(sweep, layer, region));
  return text;
}

std::string pictures(const SweepResult& sweep, const PictureSettings& settings, bool allFamilies) {
  const int zoom = std::max(1, 320 / std::max(1, sweep.width));
  const int w = sweep.width * zoom, h = sweep.height * zoom;
  const float exposure = exposureFor(sweep.referenceImage);
  std::string text = "<div class=\"pictures\">\n";
  text += figure(pictureTag(framePicture(sweep.referenceImage, exposure, settings),
                            "reference of " + sweep.name, w, h),
                 fmt::format("reference, {} samples a pixel, exposure {:+.1f} stops",
                             sweep.reference.samples, std::round(10 * exposure) / 10 + 0.0f));
  for (const PointResult& p : sweep.points) {
    if (p.frame.channels().empty()) continue;  // not the family's most work
    if (!allFamilies && p.family != "view" && p.family != "path_traced") continue;
    text += figure(pictureTag(framePicture(p.frame, exposure, settings), p.label, w, h) +
                       pictureTag(errorMapPicture(p.frame, sweep.referenceImage),
                                  "error map of " + p.label, w, h),
                   fmt::format("{}; below, its error", p.label));
  }
  text += "</div>\n";
  return text +
         figure(pictureTag(errorScalePicture(320, 16), "scale of the error maps", 320, 16),
                fmt::format("Error maps: too dark by {0:.0f} % (black), right (middle grey), "
                            "too bright by {0:.0f} % (white)",
                            100 * kMapLimit));
}

std::string hardCases(const StudyResult& result, const PictureSettings& settings) {
  if (result.sweeps.size() < 2) return {};
  std::string text =
      heading(2, "Where the photosphere has a hard time") + tableTag(hardCaseTable(result));
  for (std::size_t i = 1; i < result.sweeps.size(); ++i) {
    const SweepResult& sweep = result.sweeps[i];
    text += heading(3, sweep.name) + paragraph(fmt::format("{}; {} x {} pixels.", sweep.description,
                                                           sweep.width, sweep.height));
    const std::vector<Curve> curves = curvesOf(sweep, kMultiple, kAllPixels);
    text += figure(errorPlot(curves, sweep.name + ": layer multiple, all pixels",
                             fmt::format("hard{}", static_cast<char>('a' + i)), 1000, 420),
                   "As above.");
    text += tableTag(errorTable(sweep, kMultiple, kAllPixels)) + pictures(sweep, settings, false);
  }
  return text;
}

std::string page(const StudyResult& result, const PictureSettings& settings) {
  const SweepResult& main = result.sweeps.front();
  std::string body = heading(1, "Error against time: " + result.scene) + introduction(result);
  body += heading(2, "When to use which") + "<ul>\n";
  for (const std::string& sentence : advice(result))
    body += "<li>" + escape(sentence) + "</li>\n";
  body += "</ul>\n" + heading(2, "Error against time") + sweepPlots(main, "main");
  body += heading(2, "Equal time, equal error, crossovers") + comparisonTables(main);
  body += heading(2, "Pictures and error maps") + pictures(main, settings, true);
  body += heading(2, "Time and memory") + tableTag(pointTable(main));
  body += heading(2, "Bias and variance") + errorTables(main);
  body += hardCases(result, settings);
  if (!result.bases.empty())
    body += heading(2, "Bases of directions") + tableTag(basisTable(result));
  if (const Table table = estimateTable(result); table.rows.size() > 1)
    body += heading(2, "How true the estimate of a frame's error is") +
            paragraph(
                "render --target-error goes on until the error that a frame estimates of itself, "
                "plus what the estimate leaves in doubt, is below the one asked for: noise from "
                "independent parts of the frame, bias from path traced means over blocks of it "
                "and, within blocks, from a wider kernel. The noise of the reference is taken off "
                "what was measured.") +
            tableTag(table);
  if (!result.flicker.empty())
    body += heading(2, "Flicker") +
            paragraph(
                "Still: one frame of smoke rendered as several frames. Moving: the frames of "
                "the sequence, each against its own reference. What is measured is how the "
                "error changes from one frame to the next, which is what flickers.") +
            tableTag(flickerTable(result));
  body += heading(2, "References") + tableTag(referenceTable(result));
  body += heading(2, "Left out") + tableTag(leftOutTable(result)) + definitions();
  return pageText("photosphere study: " + result.scene, body);
}

}  // namespace

void writeReport(const StudyResult& result, const StudyOptions& options) {
  writeFile(options.output / "study.csv", csvText(result));
  writeFile(options.output / "study.json", jsonText(result));
  writeFile(options.output / "index.html", page(result, pictureSettings(result, options)));
}

}  // namespace photosphere::study
