#include "columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "photosphere/volume/particle_set.h"

namespace photosphere::caches {

namespace {

struct KnownGroup {
  std::string_view name;
  std::vector<std::string_view> members;
};

const std::vector<KnownGroup>& knownGroups() {
  static const std::vector<KnownGroup> groups = {
      {"P", {"x", "y", "z"}},
      {"P", {"px", "py", "pz"}},
      {"P", {"posx", "posy", "posz"}},
      {"v", {"vx", "vy", "vz"}},
      {"v", {"velx", "vely", "velz"}},
      {"v", {"velocityx", "velocityy", "velocityz"}},
      {"N", {"nx", "ny", "nz"}},
      {"N", {"normalx", "normaly", "normalz"}},
      {"Cd", {"red", "green", "blue"}},
      {"Cd", {"r", "g", "b"}},
      {"Cd", {"diffuse_red", "diffuse_green", "diffuse_blue"}},
      {"Cd", {"cdr", "cdg", "cdb"}},
      {"uv", {"u", "v"}},
      {"uv", {"s", "t"}},
  };
  return groups;
}

/// `velocity_x`, `P.y`, `Points:2`, `orient[3]`, `heat_0`: base and component, or -1.
int splitComponent(std::string_view name, std::string_view& base) {
  base = name;
  if (!name.empty() && name.back() == ']') {
    const std::size_t open = name.rfind('[');
    if (open == name.npos || open == 0) return -1;
    int component = -1;
    const std::string_view digits = name.substr(open + 1, name.size() - open - 2);
    const auto result = std::from_chars(digits.data(), digits.data() + digits.size(), component);
    if (result.ec != std::errc() || result.ptr != digits.data() + digits.size()) return -1;
    base = name.substr(0, open);
    return component;
  }
  const std::size_t mark = name.find_last_of("._:");
  if (mark == name.npos || mark == 0 || mark + 1 == name.size()) return -1;
  const std::string_view suffix = name.substr(mark + 1);
  int component = -1;
  const auto result = std::from_chars(suffix.data(), suffix.data() + suffix.size(), component);
  const bool isNumber = result.ec == std::errc() && result.ptr == suffix.data() + suffix.size();
  if (!isNumber) {
    const std::string letter = lowered(suffix);
    component = letter == "x" || letter == "r"   ? 0
                : letter == "y" || letter == "g" ? 1
                : letter == "z" || letter == "b" ? 2
                : letter == "w" || letter == "a" ? 3
                                                 : -1;
  }
  if (component >= 0) base = name.substr(0, mark);
  return component;
}

bool takeKnown(const KnownGroup& known, const std::vector<std::string>& lower,
               std::vector<bool>& used, std::vector<ColumnGroup>& groups) {
  std::vector<std::size_t> columns;
  for (const std::string_view member : known.members) {
    const auto at = std::find(lower.begin(), lower.end(), member);
    const std::size_t index = static_cast<std::size_t>(at - lower.begin());
    if (at == lower.end() || used[index]) return false;
    columns.push_back(index);
  }
  for (const std::size_t index : columns)
    used[index] = true;
  groups.push_back({std::string(known.name), std::move(columns)});
  return true;
}

/// Follows the components that come after column `first`, side by side.
void takeRun(std::size_t first, const std::vector<std::string>& names, std::vector<bool>& used,
             std::vector<ColumnGroup>& groups) {
  std::string_view base;
  const int component = splitComponent(names[first], base);
  std::vector<std::size_t> run{first};
  for (std::size_t i = first + 1; i < names.size() && !used[i]; ++i) {
    std::string_view other;
    const int next = splitComponent(names[i], other);
    const bool numbered = component == 0 && next == static_cast<int>(run.size()) && other == base;
    if (!numbered && names[i] != names[first]) break;
    run.push_back(i);
  }
  const bool single = run.size() == 1;
  const std::string_view name = single || component < 0 ? std::string_view(names[first]) : base;
  for (const std::size_t index : run)
    used[index] = true;
  groups.push_back({attributeName(name), std::move(run)});
}

}  // namespace

std::string attributeName(std::string_view name) {
  const std::string lower = lowered(name);
  return lower == "normal" || lower == "normals" ? "N" : volume::houdiniName(name);
}

std::string lowered(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

std::vector<ColumnGroup> groupColumns(const std::vector<std::string>& names) {
  std::vector<std::string> lower;
  for (const std::string& name : names)
    lower.push_back(lowered(name));
  std::vector<bool> used(names.size(), false);
  std::vector<ColumnGroup> groups;
  for (const KnownGroup& known : knownGroups())
    takeKnown(known, lower, used, groups);
  for (std::size_t i = 0; i < names.size(); ++i)
    if (!used[i]) takeRun(i, names, used, groups);
  std::sort(groups.begin(), groups.end(), [](const ColumnGroup& a, const ColumnGroup& b) {
    return a.columns.front() < b.columns.front();
  });
  // Two columns that mean the same (`radius` and `pscale`) keep apart by their own names.
  std::map<std::string, int> taken;
  for (ColumnGroup& group : groups) {
    const bool first = taken[group.name]++ == 0;
    if (first && (group.name != "P" || group.columns.size() == 3)) continue;
    const std::string& own = names[group.columns.front()];
    group.name = own;
    for (int n = 2; taken.count(group.name) > 0; ++n)
      group.name = fmt::format("{}_{}", own, n);
    ++taken[group.name];
  }
  return groups;
}

std::string repeatedColumn(const std::vector<std::string>& names,
                           const std::vector<ColumnGroup>& groups) {
  static constexpr std::string_view kScalars[] = {"pscale", "mass", "density", "temperature",
                                                  "age",    "life", "id"};
  std::set<std::string_view> taken;
  for (const ColumnGroup& group : groups) {
    const bool scalar =
        std::find(std::begin(kScalars), std::end(kScalars), group.name) != std::end(kScalars);
    // One name for all components is Krakatoa's way to write vectors.
    std::set<std::string_view> own;
    for (const std::size_t column : group.columns)
      if (!own.insert(names[column]).second && scalar) return names[column];
    for (const std::string_view name : own)
      if (!taken.insert(name).second) return std::string(name);
  }
  return {};
}

std::vector<std::string> columnNames(std::string_view attribute, int arity) {
  if (arity == 1) return {attribute == "pscale" ? std::string("radius") : std::string(attribute)};
  if (arity == 3) {
    if (attribute == "P") return {"x", "y", "z"};
    if (attribute == "v") return {"vx", "vy", "vz"};
    if (attribute == "N") return {"nx", "ny", "nz"};
    if (attribute == "Cd") return {"red", "green", "blue"};
  }
  std::vector<std::string> names;
  for (int c = 0; c < arity; ++c)
    names.push_back(fmt::format("{}_{}", attribute, c));
  return names;
}

}  // namespace photosphere::caches
