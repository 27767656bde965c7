#include "stats_file.h"

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/log.h"
#include "photosphere/core/output_file.h"

namespace photosphere::cli {

namespace {

using Json = nlohmann::ordered_json;

void write(const std::string& path, const Json& json) {
  // Paths need not be UTF-8; JSON must be.
  writeFile(path, json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n');
}

/// The library copies and writes values by recursion; ours are five deep.
constexpr int kMostDepth = 32;

}  // namespace

Json readStatsFile(const std::string& path) {
  const auto damaged = [&](const std::string& how) {
    return InputError(path, how + "; it is no file of --stats with several frames");
  };
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path, "cannot be opened");
  Json frames = Json::parse(
      in,
      [&](int depth, Json::parse_event_t, Json&) {
        if (depth > kMostDepth) throw damaged("has values within values without end");
        return true;
      },
      false);
  if (!frames.is_array()) throw damaged("is damaged");
  for (const Json& object : frames)
    if (!object.is_object() || !object.contains("frame") || !object["frame"].is_number_integer())
      throw damaged("holds something else than frames");
  return frames;
}

StatsFile::StatsFile(std::string path, std::size_t frames)
    : m_path(std::move(path)),
      m_single(frames == 1),
      m_frames(std::make_unique<Json>(Json::array())) {}

StatsFile::~StatsFile() = default;

void StatsFile::add(std::int64_t frame, const std::string& output,
                    const scene::FrameStatistics& statistics) {
  if (m_path.empty()) return;
  Json object{{"frame", frame}, {"output", output}};
  object.update(Json::parse(scene::statsJson(statistics)));
  if (hasFrameToken(m_path)) return write(framePath(m_path, frame), object);
  m_frames->push_back(std::move(object));
  write(m_path, m_single ? m_frames->front() : *m_frames);
}

void StatsFile::keep(std::int64_t frame) {
  if (m_path.empty() || hasFrameToken(m_path)) return;
  if (!m_earlier) {
    m_earlier = std::make_unique<Json>(Json::array());
    std::error_code error;
    if (std::filesystem::exists(m_path, error)) try {
        *m_earlier = readStatsFile(m_path);
      } catch (const InputError& damage) {
        log::warning(
            "{}; what it said of the frames that are kept is lost; --resume never makes them again",
            damage.what());
      }
  }
  for (const Json& object : *m_earlier)
    if (object["frame"] == frame) m_frames->push_back(object);
}

}  // namespace photosphere::cli
