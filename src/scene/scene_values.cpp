// Values of a parsed scene file, and keys over time in place of them.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "photosphere/core/error.h"
#include "scene_reader.h"

namespace photosphere::scene {

namespace {

ParamValue arrayValue(const toml::array& array, std::string_view key, const std::string& place) {
  if (!array.empty() && array.front().is_table())
    throw ConfigError(fmt::format(
        "{}: '{}' cannot have keys over time; numbers of the camera, volumes and lights can", place,
        key));
  std::vector<double> numbers;
  std::vector<std::string> texts;
  for (const toml::node& item : array) {
    if (const auto number = item.value<double>(); number && item.is_number())
      numbers.push_back(*number);
    else if (const auto* text = item.as_string())
      texts.push_back(text->get());
    else
      throw ConfigError(fmt::format("{}: '{}' must hold numbers or text alone", place, key));
  }
  if (!numbers.empty() && !texts.empty())
    throw ConfigError(fmt::format("{}: '{}' mixes numbers and text", place, key));
  if (!texts.empty()) return texts;
  return numbers;
}

}  // namespace

std::string textOf(const toml::node& node, std::string_view key, const std::string& place) {
  const auto* text = node.as_string();
  if (!text) throw ConfigError(fmt::format("{}: '{}' must be text", place, key));
  return text->get();
}

ParamValue valueOf(const toml::node& node, std::string_view key, const std::string& place) {
  if (const auto* flag = node.as_boolean()) return flag->get();
  if (const auto* integer = node.as_integer()) return integer->get();
  if (const auto* real = node.as_floating_point()) return real->get();
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* array = node.as_array()) return arrayValue(*array, key, place);
  throw ConfigError(
      fmt::format("{}: '{}' must be a plain value, not a table or a date", place, key));
}

bool hasRow(const ParamValues& values, std::string_view key) {
  return std::any_of(values.rows().begin(), values.rows().end(),
                     [&](const Param& p) { return p.name == key; });
}

void SceneReader::readAnimated(const std::string& path, const std::string& key,
                               const toml::node& node, ParamValues& values, Tracks& keys) const {
  const std::string place = where(node, path + "." + key, path);
  if (!hasRow(values, key)) return values.set(key, ParamValue(), place);  // reports the unknown key
  const toml::array* array = node.as_array();
  const Param& row = *std::find_if(values.rows().begin(), values.rows().end(),
                                   [&](const Param& p) { return p.name == key; });
  // The size of a frame stays.
  if (array && !array->empty() && array->front().is_table() && isKeyable(row.type) &&
      key != "resolution")
    return readKeys(path, row, *array, values, keys);
  values.set(key, valueOf(node, key, place), place);
}

void SceneReader::readKeys(const std::string& path, const Param& row, const toml::array& from,
                           ParamValues& values, Tracks& keys) const {
  const std::string key(row.name);
  Track track;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const toml::node& item = *from.get(i);
    const std::string place = where(item, fmt::format("{}.{}.{}", path, key, i), path);
    const toml::table* entry = item.as_table();
    const toml::node* frame = entry ? entry->get("frame") : nullptr;
    const toml::node* value = entry ? entry->get("value") : nullptr;
    if (!frame || !frame->is_number() || !value || entry->size() != 2)
      throw ConfigError(fmt::format(
          "{}: every key of '{}' is a table of two, {{ frame = 1, value = ... }}", place, key));
    const double time = *frame->value<double>();
    if (!std::isfinite(time))
      throw ConfigError(fmt::format("{}: a key of '{}' has no finite frame", place, key));
    if (!track.empty() && !(time > track.back().frame))
      throw ConfigError(
          fmt::format("{}: the keys of '{}' must stand in the order of their frames, each frame "
                      "once; {} comes after {}",
                      place, key, time, track.back().frame));
    values.set(key, valueOf(*value, key, place), place);
    track.push_back({time, numbersOf(values, row)});
  }
  const std::string place = where(from, path + "." + key, path);
  const std::string complaint = matrixComplaint(track);
  if (!complaint.empty()) throw ConfigError(fmt::format("{}: '{}': {}", place, key, complaint));
  keys[key] = std::move(track);
  setToTime({{key, {keys[key].front()}}}, 0, values, place);
}

}  // namespace photosphere::scene
