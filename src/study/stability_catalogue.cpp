#include "stability_catalogue.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

// The parser behaves as that header makes it, in the whole program or nowhere.
#include "../scene/toml_text.h"
#include "photosphere/core/error.h"
#include "photosphere/core/input_file.h"
#include "photosphere/core/shipped_data.h"

namespace photosphere::study {

namespace fs = std::filesystem;

namespace {

// Reads one table: every key must be asked for.
class TableReader {
 public:
  TableReader(const toml::table& table, std::string file, std::string each)
      : m_table(table), m_file(std::move(file)), m_each(std::move(each)) {}

  [[noreturn]] void refuse(const std::string& what) const {
    throw ConfigError(fmt::format("{}:{}: {}", m_file, m_table.source().begin.line, what));
  }
  const toml::node* find(const std::string& key) {
    m_asked.push_back(key);
    return m_table.get(key);
  }
  void text(const std::string& key, std::string& out) {
    const toml::node* node = find(key);
    if (!node) return;
    if (!node->is_string()) refuse(fmt::format("'{}' must be text", key));
    out = filled(node->as_string()->get());
  }
  template <class Number>
  void number(const std::string& key, Number& out) {
    const toml::node* node = find(key);
    if (!node) return;
    if (!node->is_number()) refuse(fmt::format("'{}' must be a number", key));
    out = static_cast<Number>(*node->value<double>());
  }
  void flag(const std::string& key, bool& out) {
    const toml::node* node = find(key);
    if (!node) return;
    if (!node->is_boolean()) refuse(fmt::format("'{}' must be true or false", key));
    out = node->as_boolean()->get();
  }
  void texts(const std::string& key, std::vector<std::string>& out) {
    const toml::node* node = find(key);
    if (!node) return;
    const toml::array* array = node->as_array();
    if (!array) refuse(fmt::format("'{}' must be a list of texts", key));
    for (const toml::node& item : *array) {
      if (!item.is_string()) refuse(fmt::format("'{}' must be a list of texts", key));
      out.push_back(filled(item.as_string()->get()));
    }
  }
  bool values(const std::string& name, SmokeSpec& out) {
    const toml::node* node = find(name);
    if (!node) return false;
    const toml::table* table = node->as_table();
    if (!table) refuse(fmt::format("'{}' must be a table", name));
    for (const auto& [key, value] : *table)
      readValue(std::string(key.str()), value, out);
    return true;
  }
  void finish() const {
    for (const auto& [key, node] : m_table)
      if (std::find(m_asked.begin(), m_asked.end(), key.str()) == m_asked.end())
        throw ConfigError(fmt::format("{}:{}: unknown key '{}' (known: {})", m_file,
                                      node.source().begin.line, key.str(),
                                      fmt::join(m_asked, ", ")));
  }
  TableReader inner(const toml::table& table) const { return {table, m_file, m_each}; }

 private:
  // `{}` stands for the item of `for`.
  std::string filled(std::string text) const {
    for (std::size_t at = text.find("{}"); at != std::string::npos; at = text.find("{}", at))
      text.replace(at, 2, m_each);
    return text;
  }
  void readValue(const std::string& key, const toml::node& value, SmokeSpec& out) const {
    if (value.is_number()) {
      out.numbers[key] = {*value.value<double>()};
    } else if (const auto* text = value.as_string()) {
      const std::string written = filled(text->get());
      char* end = nullptr;
      const double number = std::strtod(written.c_str(), &end);
      if (!written.empty() && *end == '\0')
        out.numbers[key] = {number};
      else
        out.texts[key] = written;
    } else if (const auto* array = value.as_array()) {
      for (const toml::node& item : *array) {
        if (!item.is_number()) refuse(fmt::format("'{}' must hold numbers", key));
        out.numbers[key].push_back(*item.value<double>());
      }
    } else {
      refuse(fmt::format("'{}' must be a number, a text or a list of numbers", key));
    }
  }

  const toml::table& m_table;
  std::string m_file, m_each;
  std::vector<std::string> m_asked;
};

void readOracle(TableReader& from, StabilityOracle& oracle) {
  from.text("kind", oracle.kind);
  from.text("source", oracle.source);
  from.number("value", oracle.value);
  from.number("scale", oracle.scale);
  from.number("least", oracle.least);
  from.number("code", oracle.code);
  from.text("message", oracle.message);
  from.number("samples", oracle.samples);
  oracle.ownSmoke = from.values("smoke", oracle.smoke);
  from.flag("bare", oracle.bare);
  from.texts("set", oracle.set);
  from.finish();
}

StabilityCase readCase(const toml::table& table, const std::string& file, const std::string& each) {
  TableReader from(table, file, each);
  StabilityCase c;
  from.find("for");
  from.text("name", c.name);
  from.text("hard", c.hard);
  from.text("trace", c.trace);
  from.values("smoke", c.smoke);
  from.values("slab", c.slab);
  from.texts("set", c.set);
  from.texts("quick_set", c.quickSet);
  from.texts("estimators", c.estimators);
  from.texts("quick_estimators", c.quickEstimators);
  from.flag("quick", c.quick);
  from.text("layer", c.layer);
  from.text("metric", c.metric);
  from.number("block", c.block);
  from.number("seeds", c.seeds);
  from.number("lights", c.lights);
  from.number("spread", c.spread);
  from.flag("allow_invalid", c.allowInvalid);
  if (const toml::node* node = from.find("crop"))
    if (const toml::array* numbers = node->as_array())
      for (const toml::node& n : *numbers)
        c.crop.push_back(n.value_or(0));
  from.text("says", c.says);
  from.text("writes", c.writes);
  from.number("bound", c.bound);
  c.quickBound = c.bound;
  from.number("quick_bound", c.quickBound);
  SmokeSpec bounds;
  from.values("bounds", bounds);
  for (const auto& [name, value] : bounds.numbers)
    c.bounds[name] = value.front();
  const toml::node* oracle = from.find("oracle");
  from.finish();
  if (c.name.empty() || c.hard.empty()) from.refuse("a case needs 'name' and 'hard'");
  if (!oracle || !oracle->is_table()) from.refuse(fmt::format("{}: 'oracle' is missing", c.name));
  TableReader inner = from.inner(*oracle->as_table());
  readOracle(inner, c.oracle);
  return c;
}

std::vector<std::string> itemsOf(const toml::table& table) {
  const toml::array* items = table["for"].as_array();
  if (!items) return {""};
  std::vector<std::string> out;
  for (const toml::node& item : *items)
    out.push_back(item.value_or(std::string()));
  return out;
}

std::string readText(const fs::path& path) {
  checkReadable(path, "a catalogue");
  std::ifstream in(path);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

toml::table parse(const fs::path& path) {
  return scene::parseToml(readText(path), path.string(), {}).root;
}

void readEstimators(const fs::path& path, StabilityCatalogue& catalogue) {
  const toml::table root = parse(path);
  const toml::array* tables = root["estimator"].as_array();
  for (std::size_t i = 0; tables && i < tables->size(); ++i) {
    TableReader from(*tables->get(i)->as_table(), path.string(), "");
    StabilityEstimator e;
    from.text("name", e.name);
    from.texts("set", e.set);
    from.texts("truth", e.truth);
    from.flag("always", e.always);
    from.flag("quick", e.quick);
    from.finish();
    catalogue.estimators.push_back(std::move(e));
  }
}

void readCases(const fs::path& path, StabilityCatalogue& catalogue) {
  const toml::table root = parse(path);
  const std::string stem = path.stem().string();
  const std::string kind = stem.substr(stem.find('_') + 1);
  for (const auto& [key, node] : root) {
    const toml::array* tables = node.as_array();
    if (key.str() != "case" || !tables || !tables->is_array_of_tables())
      throw ConfigError(fmt::format("{}:{}: a catalogue holds [[case]] tables alone", path.string(),
                                    node.source().begin.line));
    for (const toml::node& item : *tables)
      for (const std::string& each : itemsOf(*item.as_table()))
        catalogue.cases.emplace_back(readCase(*item.as_table(), path.string(), each)).kind = kind;
  }
}

}  // namespace

double SmokeSpec::number(const std::string& name, double fallback) const {
  const auto found = numbers.find(name);
  return found == numbers.end() ? fallback : found->second.front();
}

std::vector<double> SmokeSpec::list(const std::string& name,
                                    const std::vector<double>& fallback) const {
  const auto found = numbers.find(name);
  return found == numbers.end() ? fallback : found->second;
}

std::string SmokeSpec::text(const std::string& name, const std::string& fallback) const {
  const auto found = texts.find(name);
  return found == texts.end() ? fallback : found->second;
}

std::string SmokeSpec::key() const {
  std::string key;
  for (const auto& [name, values] : numbers)
    key += fmt::format("{}={} ", name, fmt::join(values, ","));
  for (const auto& [name, value] : texts)
    key += fmt::format("{}={} ", name, value);
  return key;
}

StabilityCatalogue readStabilityCatalogue(const fs::path& folder) {
  StabilityCatalogue catalogue;
  catalogue.folder = folder;
  catalogue.scene = readText(folder / "base.toml");
  readEstimators(folder / "estimators.toml", catalogue);
  std::vector<fs::path> files;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / "cases", error))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  if (error || files.empty())
    throw InputMissingError((folder / "cases").string(), "holds no catalogue of hard cases");
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files)
    readCases(file, catalogue);
  return catalogue;
}

fs::path shippedStabilityCatalogue() {
  if (const auto found = findShipped("hard/base.toml")) return found->parent_path();
  throw InputMissingError(
      "hard/base.toml",
      "the catalogue of hard cases that is shipped with this tool is not there; "
      "set PHOTOSPHERE_DATA to the folder that holds hard/");
}

}  // namespace photosphere::study
