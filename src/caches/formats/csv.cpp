// Text tables: CSV, XYZ, PTS and TXT, one particle a line.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "byte_writer.h"
#include "columns.h"
#include "content.h"
#include "photosphere/caches/cache_format.h"
#include "photosphere/core/error.h"
#include "photosphere/core/log.h"
#include "text_number.h"
#include "text_table.h"

namespace photosphere::caches::plugins {
namespace {

constexpr std::size_t kBlock = std::size_t(1) << 20;

bool isPts(const std::filesystem::path& path) {
  return lowered(path.extension().string()) == ".pts";
}

CacheContent read(const std::filesystem::path& path, const ParamValues& options) {
  FileReader file(path);
  const std::string& columns = options.text("columns");
  std::vector<std::string> names;
  if (!columns.empty()) names = splitCells(columns, sniffDelimiter(columns));
  CacheContent content;
  content.particles.push_back(readTable(file, names, isPts(path), content.notes));
  content.particleNames.push_back("points");
  return content;
}

/// Whole numbers keep a `.0`, so that a reader sees that the column is real. Large ones have an
/// exponent: written out, a float would show more than the nine digits that mark a column as float.
template <class T>
void appendReal(std::string& text, T value) {
  const std::size_t begin = text.size();
  char buffer[40];
  const auto result =
      std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general);
  text.append(buffer, result.ptr);
  if (text.find_first_not_of("-0123456789", begin) == text.npos) text += ".0";
}

void appendQuoted(std::string& text, const std::string& value) {
  text += '"';
  for (const char c : value) {
    if (c == '"') text += '"';
    // A line is a particle, so a line break inside a text cannot stay.
    text += c == '\n' || c == '\r' || c == '\0' ? ' ' : c;
  }
  text += '"';
}

void appendValue(std::string& text, const volume::Attribute& attribute, std::size_t index) {
  std::visit(
      [&](const auto& column) {
        using Value = typename std::decay_t<decltype(column)>::value_type;
        if constexpr (std::is_same_v<Value, std::string>)
          appendQuoted(text, column[index]);
        else if constexpr (std::is_floating_point_v<Value>)
          appendReal(text, column[index]);
        else
          appendNumber(text, column[index]);
      },
      attribute.data);
}

/// `x,y,z,vx,..`; names may not hold what separates them.
std::string headerLine(const WritableParticles& particles, char delimiter,
                       const std::string& path) {
  std::string header;
  std::set<std::string> taken;
  const auto add = [&](std::string_view attribute, int arity) {
    for (std::string column : columnNames(attribute, arity)) {
      std::replace_if(
          column.begin(), column.end(),
          [](char c) { return c == ',' || c == ';' || c == '"' || (c >= 0 && c <= ' '); }, '_');
      if (!taken.insert(column).second)
        throw ConfigError(
            fmt::format("{}: two attributes would be column '{}'; rename one", path, column));
      if (!header.empty()) header += delimiter;
      header += column;
    }
  };
  add("P", 3);
  for (const volume::Attribute* attribute : particles.attributes)
    add(attribute->name, attribute->arity);
  return header + "\n";
}

void writeRows(ByteWriter& file, const WritableParticles& particles, char delimiter) {
  std::string text;
  for (std::size_t i = 0; i < particles.set.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      if (c > 0) text += delimiter;
      appendNumber(text, particles.set.positions[i][c]);
    }
    for (const volume::Attribute* attribute : particles.attributes) {
      const std::size_t arity = static_cast<std::size_t>(attribute->arity);
      for (std::size_t c = 0; c < arity; ++c) {
        text += delimiter;
        appendValue(text, *attribute, i * arity + c);
      }
    }
    text += '\n';
    if (text.size() < kBlock) continue;
    file.write(text);
    text.clear();
  }
  file.write(text);
}

/// Leica PTS: the count, then `x y z`, or `x y z intensity red green blue` where there are colours.
void writePts(ByteWriter& file, const volume::ParticleSet& particles, const std::string& path) {
  const volume::Attribute* colour = particles.find("Cd");
  const volume::Attribute* intensity = particles.find("intensity");
  if (colour && colour->arity != 3) colour = nullptr;
  for (const volume::Attribute& attribute : particles.attributes)
    if (&attribute != colour && &attribute != intensity)
      log::warning("{}: PTS holds no attribute '{}'; left out (write .csv to keep it)", path,
                   attribute.name);
  std::string text = fmt::format("{}\n", particles.size());
  for (std::size_t i = 0; i < particles.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      if (c > 0) text += ' ';
      appendNumber(text, particles.positions[i][c]);
    }
    if (colour || intensity) {
      text += ' ';
      appendNumber(text, intensity ? intensity->number(i) : 0.0);
    }
    for (int c = 0; colour && c < 3; ++c) {
      text += ' ';
      const double value = colour->number(i, c);
      appendNumber(text, value > 0 ? static_cast<int>(std::lround(std::min(value, 1.0) * 255)) : 0);
    }
    text += '\n';
    if (text.size() < kBlock) continue;
    file.write(text);
    text.clear();
  }
  file.write(text);
}

void write(const std::filesystem::path& path, const CacheContent& content, const ParamValues&) {
  const WritableParticles particles = onlyParticles(path, content, "CSV", true);
  if (isPts(path)) {
    ByteWriter file(path);
    writePts(file, particles.set, path.string());
    return file.commit();
  }
  const bool comma = lowered(path.extension().string()) == ".csv";
  const char delimiter = comma ? ',' : '\t';
  const std::string header = headerLine(particles, delimiter, path.string());
  ByteWriter file(path);
  // Programs that read bare .xyz and .txt skip a comment; this reader takes the names from it.
  if (!comma) file.write("# ");
  file.write(header);
  writeRows(file, particles, delimiter);
  file.commit();
}

constexpr Param kParams[] = {
    {.name = "columns",
     .type = ParamType::text,
     .unit = "",
     .defaultText = "",
     .help = "column names by position, such as `x y z vx vy vz`; `-` leaves a column out"},
};
constexpr std::string_view kExtensions[] = {".csv", ".xyz", ".pts", ".txt", ".tsv", ".asc"};

}  // namespace

extern const CacheFormat csv;
const CacheFormat csv = {
    "csv", "text tables (CSV, XYZ, PTS, TXT)", kParams, kExtensions, nullptr, read, write};

}  // namespace photosphere::caches::plugins
