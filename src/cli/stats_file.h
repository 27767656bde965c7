#pragma once
// The file of --stats.

#include <cstdint>
#include <string>

#include <memory>
#include <nlohmann/json_fwd.hpp>

#include "photosphere/scene/pipeline.h"

namespace photosphere::cli {

/// What a file of --stats says of several frames: an array of objects, each with its `frame`.
/// @throws InputError  the file cannot be read as that
nlohmann::ordered_json readStatsFile(const std::string& path);

/// Collects the statistics of frames. A path with `####` gets one file a frame; else the file holds
/// one object where one frame is made and an array of objects where there are several. It is
/// written after each frame, so that a run that was stopped leaves what it has done.
class StatsFile {
 public:
  /// @param path  empty = none
  StatsFile(std::string path, std::size_t frames);
  ~StatsFile();
  /// @throws OutputError
  void add(std::int64_t frame, const std::string& output, const scene::FrameStatistics& statistics);
  /// Keeps what an interrupted run of the same job wrote of a frame that it had finished.
  void keep(std::int64_t frame);

 private:
  std::string m_path;
  bool m_single = false;
  std::unique_ptr<nlohmann::ordered_json> m_frames;
  std::unique_ptr<nlohmann::ordered_json> m_earlier;  // what was there before; null = not read yet
};

}  // namespace photosphere::cli
