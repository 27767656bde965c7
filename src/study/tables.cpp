#include "tables.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace photosphere::study {

namespace {

using Json = nlohmann::ordered_json;

Json number(double value) {
  if (std::isfinite(value)) return value;
  return nullptr;
}

Json toJson(const Estimate& e) {
  return {{"value", number(e.value)}, {"low", number(e.low)}, {"high", number(e.high)}};
}

Json toJson(const Spread& s) {
  return {{"median", number(s.median)}, {"min", number(s.min)}, {"max", number(s.max)}};
}

Json toJson(const std::vector<LeftOut>& leftOut) {
  Json list = Json::array();
  for (const LeftOut& item : leftOut)
    list.push_back({{"name", item.name}, {"why", item.why}});
  return list;
}

Json toJson(const PointResult& p) {
  Json errors;
  for (std::size_t layer = 0; layer < kLayers.size(); ++layer)
    for (std::size_t region = 0; region < kRegions.size(); ++region) {
      const ErrorFigures& f = p.errors[layer][region];
      errors[kLayers[layer]][kRegions[region]] = {
          {"rel_mse", toJson(f.relMse)},
          {"bias_squared", toJson(f.biasSquared)},
          {"variance", toJson(f.variance)},
          {"mean_ratio", toJson(f.meanRatio)},
          {"reference_noise_subtracted", number(f.referenceNoise)}};
    }
  return {{"family", p.family},
          {"label", p.label},
          {"settings", p.settings},
          {"work", p.work},
          {"seeds", p.seeds},
          {"seconds",
           {{"read", toJson(p.seconds.read)},
            {"rasterize", toJson(p.seconds.rasterize)},
            {"trace", toJson(p.seconds.trace)},
            {"resolve", toJson(p.seconds.resolve)},
            {"march", toJson(p.seconds.march)},
            {"total", toJson(p.seconds.total)}}},
          {"cpu_seconds", toJson(p.cpuSeconds)},
          {"peak_memory_bytes", toJson(p.peakMemoryBytes)},
          {"photons_stored", p.photonsStored},
          {"light_memory_bytes", p.lightMemoryBytes},
          {"estimated_error", toJson(p.estimatedError)},
          {"errors", std::move(errors)}};
}

Json toJson(const SweepResult& sweep) {
  Json points = Json::array();
  for (const PointResult& point : sweep.points)
    points.push_back(toJson(point));
  const ReferenceNote& r = sweep.reference;
  return {{"name", sweep.name},
          {"description", sweep.description},
          {"overrides", sweep.sets},
          {"resolution", {sweep.width, sweep.height}},
          {"start_memory_bytes", sweep.startMemoryBytes},
          {"reference",
           {{"key", r.key},
            {"method", r.method},
            {"continued_from", r.origin},
            {"samples_before", r.samplesBefore},
            {"samples", r.samples},
            {"seconds", number(r.seconds)},
            {"noise_rel_mse_total", number(r.noise[kTotal])},
            {"noise_rel_mse_multiple", number(r.noise[kMultiple])},
            {"noise_by_contenders_total", number(r.pathNoise[kTotal])},
            {"noise_by_contenders_multiple", number(r.pathNoise[kMultiple])},
            {"noise_within_a_tenth_of_the_best", r.quiet},
            {"settled", r.settled}}},
          {"points", std::move(points)},
          {"left_out", toJson(sweep.leftOut)}};
}

// Empty where a figure has no interval.
std::string cell(double value) {
  return std::isfinite(value) ? fmt::format("{:.9g}", value) : std::string();
}

std::string cells(const Estimate& e) {
  return fmt::format("{},{},{}", cell(e.value), cell(e.low), cell(e.high));
}

std::string cells(const Spread& s) {
  return fmt::format("{},{},{}", cell(s.median), cell(s.min), cell(s.max));
}

constexpr const char* kHeader =
    "sweep,family,label,settings,work,seeds,layer,region,"
    "rel_mse,rel_mse_low95,rel_mse_high95,bias_squared,bias_squared_low95,bias_squared_high95,"
    "variance,variance_low95,variance_high95,mean_ratio,mean_ratio_low95,mean_ratio_high95,"
    "reference_noise_subtracted,read_s,rasterize_s,trace_s,resolve_s,march_s,"
    "total_s,total_min_s,total_max_s,cpu_s,cpu_min_s,cpu_max_s,"
    "peak_memory_bytes,peak_memory_min_bytes,peak_memory_max_bytes,photons_stored,light_memory_"
    "bytes,"
    "estimated_error,estimated_error_min,estimated_error_max\r\n";

void addRows(std::string& text, const SweepResult& sweep, const PointResult& p) {
  const StageSpreads& s = p.seconds;
  for (std::size_t layer = 0; layer < kLayers.size(); ++layer)
    for (std::size_t region = 0; region < kRegions.size(); ++region) {
      const ErrorFigures& f = p.errors[layer][region];
      text += fmt::format("{},{},{},{},{},{},{},{},", csvField(sweep.name), csvField(p.family),
                          csvField(p.label), csvField(p.settings), p.work, p.seeds, kLayers[layer],
                          kRegions[region]);
      text += fmt::format("{},{},{},{},{},", cells(f.relMse), cells(f.biasSquared),
                          cells(f.variance), cells(f.meanRatio), cell(f.referenceNoise));
      text += fmt::format("{},{},{},{},{},", cell(s.read.median), cell(s.rasterize.median),
                          cell(s.trace.median), cell(s.resolve.median), cell(s.march.median));
      text += fmt::format("{},{},{},{},{},{}\r\n", cells(s.total), cells(p.cpuSeconds),
                          cells(p.peakMemoryBytes), p.photonsStored, p.lightMemoryBytes,
                          cells(p.estimatedError));
    }
}

}  // namespace

std::string csvField(const std::string& text) {
  std::string field;
  if (!text.empty() && std::string("=+-@\t\r").find(text[0]) != std::string::npos) field += '\'';
  field += text;
  if (field.find_first_of(",\"\r\n") == std::string::npos) return field;
  std::string quoted = "\"";
  for (const char c : field)
    quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::vector<const SweepResult*> allSweeps(const StudyResult& result) {
  std::vector<const SweepResult*> all;
  for (const auto* sweeps : {&result.sweeps, &result.bases})
    for (const SweepResult& sweep : *sweeps)
      all.push_back(&sweep);
  return all;
}

std::string csvText(const StudyResult& result) {
  std::string text = kHeader;
  for (const SweepResult* sweep : allSweeps(result))
    for (const PointResult& point : sweep->points)
      addRows(text, *sweep, point);
  return text;
}

std::string jsonText(const StudyResult& result) {
  Json sweeps = Json::array(), bases = Json::array(), flicker = Json::array();
  for (const SweepResult& sweep : result.sweeps)
    sweeps.push_back(toJson(sweep));
  for (const SweepResult& sweep : result.bases)
    bases.push_back(toJson(sweep));
  for (const FlickerRow& row : result.flicker)
    flicker.push_back({{"sequence", row.sequence},
                       {"label", row.label},
                       {"seed_per_frame", row.seedPerFrame},
                       {"pairs", row.pairs},
                       {"rel_mse", toJson(row.relMse)}});
  const Json root{
      {"scene", result.scene},
      {"frame", result.frame},
      {"version", result.version},
      {"machine", result.machine},
      {"threads", result.threads},
      {"date", result.date},
      {"minutes", number(result.minutes)},
      {"elapsed_seconds", number(result.elapsedSeconds)},
      {"quick", result.quick},
      {"start",
       {{"seconds", toJson(result.startSeconds)}, {"memory_bytes", result.startMemoryBytes}}},
      {"sweeps", std::move(sweeps)},
      {"bases", std::move(bases)},
      {"flicker", std::move(flicker)},
      {"left_out", toJson(result.leftOut)}};
  return root.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace photosphere::study
