#include "toml_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "photosphere/core/error.h"

namespace photosphere::scene {

namespace {

std::vector<std::string> segments(const std::string& path) {
  std::vector<std::string> parts(1);
  for (const char c : path) {
    if (c == '.')
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

std::optional<std::size_t> indexOf(const std::string& segment) {
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(segment.data(), segment.data() + segment.size(), index);
  if (error != std::errc() || end != segment.data() + segment.size()) return std::nullopt;
  return index;
}

[[noreturn]] void notToml(const std::string& name, std::size_t line, std::size_t column,
                          std::string_view why) {
  throw ConfigError(fmt::format("{}:{}:{}: not valid TOML: {}", name, line, column, why));
}

bool stumbles(std::string_view text) {
  try {
    static_cast<void>(toml::parse(text));
  } catch (const TomlAssertion&) {
    return true;
  } catch (const toml::parse_error&) {
    // Cut in the middle of something.
  }
  return false;
}

// The line that the parser takes for impossible: it reads forward, so it stumbles over every
// beginning of the text that holds that line.
std::size_t lineOfAssertion(std::string_view text) {
  std::vector<std::size_t> ends;
  for (std::size_t end = text.find('\n'); end != std::string_view::npos;
       end = text.find('\n', end + 1))
    ends.push_back(end);
  const auto at = std::partition_point(
      ends.begin(), ends.end(), [&](std::size_t end) { return !stumbles(text.substr(0, end)); });
  return static_cast<std::size_t>(at - ends.begin()) + 1;
}

// Parts of a dotted key: the parser counts how deep values nest, not keys, and tables are freed by
// recursion.
constexpr std::size_t kMostParts = 32;

// Where the string that opens at `i` ends: its last quote, or before the end of its line.
std::size_t endOfString(std::string_view text, std::size_t i) {
  const char quote = text[i];
  const std::string triple(3, quote);
  const bool multiline = text.substr(i, 3) == triple;
  for (i += multiline ? 3 : 1; i < text.size(); ++i) {
    if (text[i] == '\\' && quote == '"')
      ++i;
    else if (multiline && text.substr(i, 3) == triple)
      return i + 2;
    else if (!multiline && text[i] == quote)
      return i;
    else if (!multiline && text[i] == '\n')
      return i - 1;
  }
  return text.size();
}

// @throws ConfigError
void refuseLongKeys(std::string_view text, const std::string& name) {
  std::size_t dots = 0, line = 1;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"' || c == '\'') {
      const std::size_t end = std::min(endOfString(text, i), text.size() - 1);
      for (; i < end; ++i)
        line += text[i] == '\n';
    } else if (c == '#') {
      i = std::min(text.find('\n', i), text.size()) - 1;
    } else if (c == '.') {
      if (++dots == kMostParts)
        notToml(name, line, 1, fmt::format("a key of more than {} parts", kMostParts));
    } else if (std::string_view("\n,=[]{}").find(c) != std::string_view::npos) {
      dots = 0;
      line += c == '\n';
    }
  }
}

// @throws ConfigError
toml::table parseChecked(const std::string& text, const std::string& name) {
  refuseLongKeys(text, name);
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    std::string why(error.description());
    if (why.ends_with("could not determine value type")) why += "; put quotes around text";
    notToml(name, error.source().begin.line, error.source().begin.column, why);
  } catch (const TomlAssertion&) {
    notToml(name, lineOfAssertion(text), 1, "the parser cannot make sense of this line");
  }
}

// The value as TOML; text that is not TOML stands for itself.
toml::table valueTable(const std::string& text) {
  try {
    toml::table parsed = parseChecked("value = " + text, "value");
    const toml::node* value = parsed.get("value");
    const bool usable = value && parsed.size() == 1 && !value->is_date() && !value->is_time() &&
                        !value->is_date_time();
    if (usable) return parsed;
  } catch (const ConfigError&) {
    // Not TOML: a path or a name without quotes.
  }
  return toml::table{{"value", text}};
}

// The child of a table or array, created where the path goes on but the file does not.
toml::node& descend(toml::node& at, const std::string& segment, const std::string& next,
                    const std::string& set) {
  if (toml::table* table = at.as_table()) {
    if (!table->contains(segment)) {
      if (indexOf(next))
        table->insert(segment, toml::array{});
      else
        table->insert(segment, toml::table{});
    }
    return *table->get(segment);
  }
  if (toml::array* array = at.as_array()) {
    const auto index = indexOf(segment);
    if (index && *index == array->size()) array->push_back(toml::table{});
    if (index && *index < array->size()) return *array->get(*index);
    throw ConfigError(
        fmt::format("--set {}: '{}' must be an index from 0 to {}", set, segment, array->size()));
  }
  throw ConfigError(fmt::format("--set {}: nothing lies below a plain value ('{}')", set, segment));
}

// Whether the text is UTF-8, as TOML is: no byte out of place, nothing written longer than it must
// be (RFC 3629).
bool isUtf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = [&](std::size_t k) {
      return i + k < text.size() ? static_cast<unsigned char>(text[i + k]) : 0u;
    };
    const unsigned first = byte(0);
    if (first < 0x80) {
      ++i;
      continue;
    }
    const std::size_t more = first >= 0xF0 ? 3 : first >= 0xE0 ? 2 : 1;
    if (first < 0xC2 || first > 0xF4) return false;
    std::uint32_t code = first & (0x3Fu >> more);
    for (std::size_t k = 1; k <= more; ++k) {
      if ((byte(k) & 0xC0u) != 0x80u) return false;
      code = code << 6 | (byte(k) & 0x3Fu);
    }
    const std::uint32_t least = more == 1 ? 0x80 : more == 2 ? 0x800 : 0x10000;
    if (code < least || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return false;
    i += more + 1;
  }
  return true;
}

void applySet(toml::table& root, const std::string& set, TomlText& out) {
  if (!isUtf8(set))
    throw ConfigError(
        fmt::format("--set {}: is not UTF-8, as a scene is; rename the file or set "
                    "the terminal's encoding",
                    set));
  const std::size_t equals = set.find('=');
  const std::string path = set.substr(0, equals);
  if (equals == std::string::npos || path.empty())
    throw ConfigError(fmt::format("--set {}: must be dotted.path=value", set));
  const std::vector<std::string> parts = segments(path);
  if (parts.size() > kMostParts)
    throw ConfigError(
        fmt::format("--set: a path of {} parts, {} are the most", parts.size(), kMostParts));
  toml::node* at = &root;
  for (std::size_t i = 0; i + 1 < parts.size(); ++i)
    at = &descend(*at, parts[i], parts[i + 1], set);
  toml::table value = valueTable(set.substr(equals + 1));
  toml::node& node = *value.get("value");
  if (toml::table* table = at->as_table()) {
    node.visit([&](auto& typed) { table->insert_or_assign(parts.back(), std::move(typed)); });
  } else if (toml::array* array = at->as_array()) {
    const auto index = indexOf(parts.back());
    if (!index || *index >= array->size())
      throw ConfigError(fmt::format("--set {}: '{}' must be an index below {}", set, parts.back(),
                                    array->size()));
    node.visit([&](auto& typed) {
      array->replace(array->cbegin() + static_cast<std::ptrdiff_t>(*index), std::move(typed));
    });
  } else {
    throw ConfigError(fmt::format("--set {}: nothing lies below a plain value", set));
  }
  out.sets[path] = set;
}

}  // namespace

std::string TomlText::where(const toml::node& node, const std::string& dotted,
                            const std::string& table) const {
  // What the user typed may be the node itself or a table or array that it lies in.
  for (std::size_t end = dotted.size(); end != std::string::npos && end > 0;
       end = dotted.rfind('.', end - 1)) {
    const auto place = sets.find(dotted.substr(0, end));
    if (place != sets.end()) return fmt::format("--set {}: [{}]", place->second, table);
  }
  const auto line = node.source().begin.line;
  std::string place =
      fmt::format("{}{}: [{}]", name, line == 0 ? "" : fmt::format(":{}", line), table);
  // Or they are below it: then the table is partly the file's and partly theirs.
  const std::string below = dotted + ".";
  const char* between = " with";
  for (auto set = sets.lower_bound(below); set != sets.end() && set->first.starts_with(below);
       ++set)
    place += fmt::format("{} --set {}", std::exchange(between, ","), set->second);
  return place;
}

TomlText parseToml(const std::string& text, const std::string& name,
                   const std::vector<std::string>& sets) {
  TomlText out;
  out.name = name;
  out.root = parseChecked(text, name);
  for (const std::string& set : sets)
    applySet(out.root, set, out);
  return out;
}

}  // namespace photosphere::scene
