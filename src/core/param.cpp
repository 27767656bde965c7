#include "photosphere/core/param.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "photosphere/core/error.h"

namespace photosphere {

namespace {

std::string_view trimmed(std::string_view s) {
  while (!s.empty() && (s.front() == ' ' || s.front() == '\t'))
    s.remove_prefix(1);
  while (!s.empty() && (s.back() == ' ' || s.back() == '\t'))
    s.remove_suffix(1);
  return s;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (!text.empty()) {
    const std::size_t at = text.find(separator);
    parts.push_back(trimmed(text.substr(0, at)));
    if (at == std::string_view::npos) break;
    text.remove_prefix(at + 1);
  }
  return parts;
}

std::string_view typeName(ParamType type) {
  switch (type) {
    case ParamType::boolean:
      return "true or false";
    case ParamType::integer:
      return "whole number";
    case ParamType::real:
      return "number";
    case ParamType::text:
      return "text";
    case ParamType::rgb:
      return "number or [r, g, b]";
    case ParamType::vec2:
      return "[x, y]";
    case ParamType::vec3:
      return "[x, y, z]";
    case ParamType::matrix:
      return "16 numbers, row by row";
    case ParamType::list:
      return "list of text";
  }
  return "";
}

[[noreturn]] void wrongType(const Param& row, const std::string& where) {
  throw ConfigError(fmt::format("{}: '{}' must be {}", where, row.name, typeName(row.type)));
}

bool parseNumber(std::string_view text, double& value) {
  text = trimmed(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

std::size_t expectedCount(ParamType type) {
  switch (type) {
    case ParamType::vec2:
      return 2;
    case ParamType::vec3:
    case ParamType::rgb:
      return 3;
    case ParamType::matrix:
      return 16;
    default:
      return 1;
  }
}

void checkRange(const Param& row, double value, const std::string& where) {
  if (std::isfinite(value) && value >= row.min && value <= row.max) return;
  std::string range;
  if (std::isfinite(row.min)) range += fmt::format(" of at least {:g}", row.min);
  if (std::isfinite(row.max))
    range += fmt::format("{} at most {:g}", range.empty() ? " of" : " and", row.max);
  throw ConfigError(
      fmt::format("{}: '{}' = {:g} is not a finite number{}", where, row.name, value, range));
}

void checkText(const Param& row, const std::string& value, const std::string& where) {
  if (row.choices.empty()) return;
  const auto choices = split(row.choices, '|');
  if (std::find(choices.begin(), choices.end(), value) == choices.end())
    throw ConfigError(fmt::format("{}: '{}' = '{}' is unknown{} (known: {})", where, row.name,
                                  value, suggestion(value, choices), fmt::join(choices, ", ")));
  for (const std::string_view unserved : split(row.unserved, '|'))
    if (unserved == value)
      throw ConfigError(
          fmt::format("{}: '{}' = '{}' is not served by this version yet", where, row.name, value));
}

// The value as the row's type wants it, or an error.
ParamValue coerce(const Param& row, ParamValue value, const std::string& where) {
  switch (row.type) {
    case ParamType::boolean:
      if (!std::holds_alternative<bool>(value)) wrongType(row, where);
      return value;
    case ParamType::integer: {
      if (const double* d = std::get_if<double>(&value)) {
        checkRange(row, *d, where);
        if (*d != std::floor(*d) || std::abs(*d) > 9e15) wrongType(row, where);
        value = static_cast<std::int64_t>(*d);
      }
      if (!std::holds_alternative<std::int64_t>(value)) wrongType(row, where);
      checkRange(row, static_cast<double>(std::get<std::int64_t>(value)), where);
      return value;
    }
    case ParamType::real:
      if (const auto* i = std::get_if<std::int64_t>(&value)) value = static_cast<double>(*i);
      if (!std::holds_alternative<double>(value)) wrongType(row, where);
      checkRange(row, std::get<double>(value), where);
      return value;
    case ParamType::text:
      if (!std::holds_alternative<std::string>(value)) wrongType(row, where);
      checkText(row, std::get<std::string>(value), where);
      return value;
    case ParamType::list:
      if (const auto* items = std::get_if<std::vector<std::string>>(&value)) {
        for (const std::string& item : *items)
          checkText(row, item, where);
        return value;
      }
      if (const auto* numbers = std::get_if<std::vector<double>>(&value);
          numbers && numbers->empty())
        return std::vector<std::string>();
      wrongType(row, where);
    default: {
      if (row.type == ParamType::rgb) {
        if (const auto* i = std::get_if<std::int64_t>(&value)) value = static_cast<double>(*i);
        if (const double* d = std::get_if<double>(&value)) value = std::vector<double>{*d, *d, *d};
      }
      const auto* numbers = std::get_if<std::vector<double>>(&value);
      if (!numbers || numbers->size() != expectedCount(row.type)) wrongType(row, where);
      for (const double n : *numbers)
        checkRange(row, n, where);
      return value;
    }
  }
}

std::string formatValue(const ParamValue& value) {
  struct Visitor {
    std::string operator()(bool b) const { return b ? "true" : "false"; }
    std::string operator()(std::int64_t i) const { return std::to_string(i); }
    std::string operator()(double d) const {
      std::string text = fmt::format("{}", d);
      // TOML wants a point or an exponent in a float.
      if (text.find_first_of(".en") == std::string::npos) text += ".0";
      return text;
    }
    std::string operator()(const std::string& s) const {
      std::string text = "\"";
      for (const char c : s) {
        if (c == '"' || c == '\\') text += '\\';
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
          text += fmt::format("\\u{:04x}", static_cast<int>(c));
        else
          text += c;
      }
      return text + '"';
    }
    std::string operator()(const std::vector<double>& v) const {
      return fmt::format("[{}]", fmt::join(v, ", "));
    }
    std::string operator()(const std::vector<std::string>& v) const {
      std::vector<std::string> quoted;
      for (const std::string& s : v)
        quoted.push_back((*this)(s));
      return fmt::format("[{}]", fmt::join(quoted, ", "));
    }
  };
  return std::visit(Visitor{}, value);
}

std::size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j)
    row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

}  // namespace

ParamValue parseParam(const Param& row, std::string_view text, const std::string& where) {
  const std::string_view t = trimmed(text);
  double number = 0;
  switch (row.type) {
    case ParamType::boolean:
      if (t == "true") return true;
      if (t == "false") return false;
      wrongType(row, where);
    case ParamType::integer:
    case ParamType::real:
      if (!parseNumber(t, number)) wrongType(row, where);
      return coerce(row, number, where);
    case ParamType::text:
      return coerce(row, std::string(text), where);
    default:
      break;
  }
  std::string_view inner = t;
  const bool bracketed = t.size() >= 2 && t.front() == '[' && t.back() == ']';
  if (bracketed) inner = t.substr(1, t.size() - 2);
  if (row.type == ParamType::list) {
    std::vector<std::string> items;
    for (std::string_view item : split(inner, ',')) {
      if (item.size() >= 2 && item.front() == '"' && item.back() == '"')
        item = item.substr(1, item.size() - 2);
      if (!item.empty()) items.emplace_back(item);
    }
    return coerce(row, items, where);
  }
  std::vector<double> numbers;
  for (const std::string_view item : split(inner, ',')) {
    if (!parseNumber(item, number)) wrongType(row, where);
    numbers.push_back(number);
  }
  if (!bracketed && numbers.size() == 1) return coerce(row, numbers.front(), where);
  return coerce(row, numbers, where);
}

ParamValues::ParamValues(std::span<const Param> rows) : m_rows(rows.begin(), rows.end()) {
  for (const Param& r : m_rows) {
    Param anyChoice = r;  // a default may be a choice that is not served yet
    anyChoice.unserved = {};
    m_values.emplace(std::string(r.name),
                     parseParam(anyChoice, r.defaultText, "default of " + std::string(r.name)));
  }
}

const ParamValue& ParamValues::value(std::string_view name) const {
  const auto found = m_values.find(name);
  if (found == m_values.end()) throw std::logic_error("no option row named " + std::string(name));
  return found->second;
}

void ParamValues::set(std::string_view name, ParamValue given, const std::string& where) {
  const auto found =
      std::find_if(m_rows.begin(), m_rows.end(), [&](const Param& p) { return p.name == name; });
  if (found == m_rows.end()) {
    std::vector<std::string_view> known;
    for (const Param& p : m_rows)
      known.push_back(p.name);
    throw ConfigError(fmt::format("{}: unknown key '{}'{} (known: {})", where, name,
                                  suggestion(name, known), fmt::join(known, ", ")));
  }
  ParamValue checked = coerce(*found, std::move(given), where);
  if (!found->served) {
    const ParamValue standard = parseParam(*found, found->defaultText, where);
    if (checked != standard)
      throw ConfigError(
          fmt::format("{}: '{}' is not served by this version yet; remove it or leave "
                      "it at its default {}",
                      where, name, formatValue(standard)));
  }
  m_values[std::string(name)] = std::move(checked);
  m_given[std::string(name)] = true;
}

void ParamValues::setText(std::string_view name, std::string_view text, const std::string& where) {
  for (const Param& r : m_rows)
    if (r.name == name) return set(name, parseParam(r, text, where), where);
  set(name, std::string(text), where);  // reports the unknown key
}

bool ParamValues::given(std::string_view name) const {
  return m_given.count(std::string(name)) > 0;
}
bool ParamValues::flag(std::string_view name) const {
  return std::get<bool>(value(name));
}
std::int64_t ParamValues::integer(std::string_view name) const {
  return std::get<std::int64_t>(value(name));
}
double ParamValues::real(std::string_view name) const {
  return std::get<double>(value(name));
}
const std::string& ParamValues::text(std::string_view name) const {
  return std::get<std::string>(value(name));
}
Vec2d ParamValues::vec2(std::string_view name) const {
  const auto& v = std::get<std::vector<double>>(value(name));
  return {v.at(0), v.at(1)};
}
Vec3d ParamValues::vec3(std::string_view name) const {
  const auto& v = std::get<std::vector<double>>(value(name));
  return {v.at(0), v.at(1), v.at(2)};
}
Rgb ParamValues::rgb(std::string_view name) const {
  return Rgb(vec3(name));
}
Mat4d ParamValues::matrix(std::string_view name) const {
  const auto& v = std::get<std::vector<double>>(value(name));
  Mat4d m(1.0);
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      m[c][r] = v.at(static_cast<std::size_t>(4 * r + c));
  return m;
}
std::vector<std::string> ParamValues::list(std::string_view name) const {
  return std::get<std::vector<std::string>>(value(name));
}
std::string ParamValues::format(std::string_view name) const {
  return formatValue(value(name));
}

std::string suggestion(std::string_view name, std::span<const std::string_view> known) {
  std::string_view best;
  std::size_t distance = std::max<std::size_t>(2, name.size() / 3) + 1;
  for (const std::string_view candidate : known) {
    const std::size_t d = editDistance(name, candidate);
    if (d < distance) {
      distance = d;
      best = candidate;
    }
  }
  return best.empty() ? std::string() : fmt::format("; did you mean '{}'?", best);
}

std::string formatParams(std::span<const Param> rows, int indent) {
  std::string text;
  for (const Param& r : rows) {
    std::string kind = r.choices.empty() ? std::string(typeName(r.type)) : std::string(r.choices);
    if (!r.unit.empty()) kind += fmt::format(" [{}]", r.unit);
    text += fmt::format("{:{}}{} = {}: {}; {}{}\n", "", indent, r.name,
                        r.defaultText.empty() ? "\"\"" : r.defaultText, kind, r.help,
                        r.served ? "" : " (not served yet)");
  }
  return text;
}

}  // namespace photosphere
