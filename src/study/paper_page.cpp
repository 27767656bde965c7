// The page, CSV and JSON of the paper's exhibits.

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "html.h"
#include "photosphere/core/output_file.h"
#include "photosphere/core/resources.h"
#include "photosphere/study/paper.h"
#include "pictures.h"
#include "tables.h"

namespace photosphere::study {

namespace {

using Json = nlohmann::ordered_json;

const char* const kNone = "\u2013";

std::string ratioText(double ratio) {
  return ratio > 0 ? fmt::format("{:.2f}", ratio) : kNone;
}

std::string valueText(const std::string& unit, double value) {
  if (!(value > 0)) return kNone;
  return unit == "bytes" ? formatBytes(static_cast<std::uint64_t>(value))
                         : fmt::format("{:.4g}", value);
}

std::string meanText(const PaperRow& row) {
  if (!row.judged) return kNone;
  if (!std::isfinite(row.meanRatio.low)) return fmt::format("{:.3f}", row.meanRatio.value);
  return fmt::format("{:.3f} ({:.3f} to {:.3f})", row.meanRatio.value, row.meanRatio.low,
                     row.meanRatio.high);
}

Table tableOf(const PaperExhibit& e) {
  Table table;
  table.rows.push_back({"", "render [s], median (range)", "peak memory [MiB]"});
  if (!e.unit.empty()) {
    table.rows[0].push_back("ours over the first");
    table.rows[0].push_back(fmt::format("paper [{}]", e.unit));
    table.rows[0].push_back("paper's over its first");
  }
  if (e.unit == "bytes") table.rows[0].push_back("ours, stored light");
  table.rows[0].push_back("multiple: mean over reference's (95 %)");
  table.rows[0].push_back("multiple: relative error");
  for (const PaperRow& row : e.rows) {
    std::vector<std::string> cells{row.label};
    if (row.measured) {
      cells.push_back(fmt::format("{:.3g} ({:.3g} to {:.3g})", row.seconds.median, row.seconds.min,
                                  row.seconds.max));
      cells.push_back(fmt::format("{:.1f}", row.peakMemoryBytes.median / 1048576));
    } else {
      cells.push_back("not measured: " + row.why);
      cells.emplace_back(kNone);
    }
    if (!e.unit.empty()) {
      cells.push_back(ratioText(ourRatio(e, row)));
      cells.push_back(valueText(e.unit, row.paperValue));
      cells.push_back(ratioText(papersRatio(e, row)));
    }
    if (e.unit == "bytes") cells.push_back(valueText(e.unit, row.lightBytes));
    cells.push_back(meanText(row));
    cells.push_back(row.judged ? fmt::format("{:.3g}", row.relativeError) : kNone);
    table.rows.push_back(std::move(cells));
  }
  return table;
}

std::string picturesOf(const PaperExhibit& e, const PaperResult& result,
                       const PictureSettings& settings) {
  const image::Image* first = nullptr;
  for (const PaperRow& row : e.rows)
    if (!first && row.measured) first = &row.frame;
  if (!e.pictures || !first) return {};
  const int zoom = std::max(1, 288 / result.width);
  const float exposure = exposureFor(*first);
  std::string text = "<div class=\"pictures\">\n";
  for (const PaperRow& row : e.rows)
    if (row.measured)
      text += fmt::format(
          "<figure>{}<figcaption>{}</figcaption></figure>\n",
          pictureTag(framePicture(row.frame, exposure, settings), e.name + ": " + row.label,
                     result.width * zoom, result.height * zoom),
          escape(row.label));
  return text + "</div>\n";
}

std::string page(const PaperResult& result, const PictureSettings& settings) {
  std::string body =
      "<h1>The exhibits of Min and Ihm 2010, on the smoke that is shipped</h1>\n<p>" +
      escape(fmt::format("{} x {} pixels; {} on {} threads of {}; begun {} UTC, took {:.0f} s{}.",
                         result.width, result.height, result.version, result.threads,
                         result.machine, result.date, result.elapsedSeconds,
                         result.quick ? ". QUICK: tiny frames and few photons; the figures say "
                                        "nothing"
                                      : "")) +
      "</p>\n<p>" +
      escape(
          "The photosphere has estimator.preset = \"paper\": the settings of the paper with its "
          "errata corrected. Seconds are those of resolve and march, as the paper times rendering "
          "and not tracing; medians over independent seeds. Ratios are over the first line of "
          "each exhibit, ours beside the paper's. References are made of paths.") +
      "</p>\n";
  for (const PaperExhibit& e : result.exhibits) {
    body += "<h2>" + escape(e.name + ": " + e.title) + "</h2>\n";
    body += "<p><strong>The paper:</strong> " + escape(e.said) + "</p>\n";
    body += picturesOf(e, result, settings) + tableTag(tableOf(e));
    body += "<p><strong>Where we differ:</strong> " + escape(e.differs) + "</p>\n";
  }
  return pageText("photosphere study: the paper's exhibits", body);
}

std::string csvOf(const PaperResult& result) {
  std::string text =
      "exhibit,label,settings,render_s,render_min_s,render_max_s,peak_memory_bytes,"
      "stored_light_bytes,our_ratio,paper_value,paper_unit,paper_ratio,mean_ratio,relative_error,"
      "why_not_measured\r\n";
  for (const PaperExhibit& e : result.exhibits)
    for (const PaperRow& row : e.rows)
      text += fmt::format(
          "{},{},{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.6g},{:.9g},{},{:.6g},{:.6g},"
          "{:.6g},{}\r\n",
          csvField(e.name), csvField(row.label), csvField(row.settings), row.seconds.median,
          row.seconds.min, row.seconds.max, row.peakMemoryBytes.median, row.lightBytes,
          ourRatio(e, row), row.paperValue, e.unit, papersRatio(e, row), row.meanRatio.value,
          row.relativeError, csvField(row.why));
  return text;
}

std::string jsonOf(const PaperResult& result) {
  Json exhibits = Json::array();
  for (const PaperExhibit& e : result.exhibits) {
    Json rows = Json::array();
    for (const PaperRow& row : e.rows)
      rows.push_back({{"label", row.label},
                      {"settings", row.settings},
                      {"measured", row.measured},
                      {"why_not", row.why},
                      {"render_seconds", row.seconds.median},
                      {"peak_memory_bytes", row.peakMemoryBytes.median},
                      {"stored_light_bytes", row.lightBytes},
                      {"our_ratio", ourRatio(e, row)},
                      {"paper_value", row.paperValue},
                      {"paper_ratio", papersRatio(e, row)},
                      {"mean_ratio", row.meanRatio.value},
                      {"relative_error", row.relativeError}});
    exhibits.push_back({{"name", e.name},
                        {"title", e.title},
                        {"unit", e.unit},
                        {"said", e.said},
                        {"differs", e.differs},
                        {"rows", std::move(rows)}});
  }
  const Json root{{"version", result.version},
                  {"machine", result.machine},
                  {"threads", result.threads},
                  {"date", result.date},
                  {"quick", result.quick},
                  {"resolution", {result.width, result.height}},
                  {"elapsed_seconds", result.elapsedSeconds},
                  {"exhibits", std::move(exhibits)}};
  return root.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace

void writePaperReport(const PaperResult& result, const StudyOptions& options) {
  writeFile(options.output / "paper.csv", csvOf(result));
  writeFile(options.output / "paper.json", jsonOf(result));
  writeFile(options.output / "index.html", page(result, pictureSettings(result, options)));
}

}  // namespace photosphere::study
