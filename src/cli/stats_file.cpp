#include "stats_file.h"

#include <fstream>
#include <nlohmann/json.hpp>

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

}  // namespace

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
    std::ifstream in(m_path);
    m_earlier = std::make_unique<Json>(Json::parse(in, nullptr, false));
    if (in.is_open() && !m_earlier->is_array())
      log::warning(
          "{}: is damaged, and what it said of the frames that are kept is lost; --resume "
          "never makes them again",
          m_path);
  }
  if (!m_earlier->is_array()) return;
  for (const Json& object : *m_earlier)
    if (object.is_object() && object.contains("frame") && object["frame"] == frame)
      m_frames->push_back(object);
}

}  // namespace photosphere::cli
