// The table of hard cases as text and as CSV.

#include <fmt/format.h>

#include "photosphere/core/error.h"
#include "photosphere/core/output_file.h"
#include "photosphere/study/stability.h"

namespace photosphere::study {

namespace {

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text)
    out += c == '"' ? "\"\"" : std::string(1, c == '\n' ? ' ' : c);
  return out + "\"";
}

std::string cut(const std::string& text, std::size_t width) {
  return text.size() <= width ? text : text.substr(0, width - 2) + "..";
}

constexpr const char* kColumns =
    "{:<6} {:<34} {:<11} {:<46} {:<40} {:>12} {:>12} {:>9} {:>7} {:>4} {:>4} {:>9} {:>7}";

}  // namespace

std::string stabilityHead() {
  return fmt::format(kColumns, "", "case", "estimator", "what is hard", "oracle", "expected",
                     "result", "error", "bound", "NaN", "neg", "capped", "seconds");
}

std::string stabilityLine(const StabilityRow& row) {
  std::string line = fmt::format(
      kColumns, row.passed ? "ok" : "FAILED", cut(row.name, 34), row.estimator, cut(row.hard, 46),
      cut(row.oracle, 40), row.expected, row.result, fmt::format("{:.2g}", row.error),
      fmt::format("{:g}", row.bound), row.nanSamples, row.negativeSamples,
      fmt::format("{:.2g}", row.cappedPower), fmt::format("{:.2f}", row.seconds));
  if (!row.message.empty()) line += "  " + row.message;
  return line;
}

std::vector<std::string> stabilityDigest(const std::vector<StabilityRow>& rows) {
  struct Kind {
    std::size_t rows = 0, failed = 0;
    const StabilityRow* closest = nullptr;
  };
  std::vector<std::pair<std::string, Kind>> kinds;  // in the order of the rows
  for (const StabilityRow& row : rows) {
    if (kinds.empty() || kinds.back().first != row.kind) kinds.emplace_back(row.kind, Kind());
    Kind& kind = kinds.back().second;
    ++kind.rows;
    if (!row.passed) ++kind.failed;
    // A bound of 0 is kept exactly or not at all.
    if (!row.passed || !(row.bound > 0)) continue;
    if (!kind.closest || row.error * kind.closest->bound > kind.closest->error * row.bound)
      kind.closest = &row;
  }
  std::vector<std::string> lines;
  for (const auto& [name, kind] : kinds) {
    lines.push_back(fmt::format("{:<10} {:>4} rows, {} outside", name, kind.rows, kind.failed));
    if (kind.closest)
      lines.back() +=
          fmt::format("; closest to its bound: {} by {}, {:.2g} of {:g}", kind.closest->name,
                      kind.closest->estimator, kind.closest->error, kind.closest->bound);
  }
  return lines;
}

void writeStabilityCsv(const std::filesystem::path& path, const std::vector<StabilityRow>& rows) {
  std::string text =
      "kind,case,estimator,hard,oracle,expected,result,error,bound,nan_samples,negative_samples,"
      "capped_power,seconds,passed,message\n";
  for (const StabilityRow& r : rows)
    text += fmt::format("{},{},{},{},{},{},{},{:.6g},{:.6g},{},{},{:.6g},{:.3f},{},{}\n",
                        quoted(r.kind), quoted(r.name), quoted(r.estimator), quoted(r.hard),
                        quoted(r.oracle), quoted(r.expected), quoted(r.result), r.error, r.bound,
                        r.nanSamples, r.negativeSamples, r.cappedPower, r.seconds,
                        r.passed ? "yes" : "no", quoted(r.message));
  writeFile(path, text);
}

}  // namespace photosphere::study
