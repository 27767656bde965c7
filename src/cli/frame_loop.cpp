#include "frame_loop.h"

#include <fmt/format.h>

#include "photosphere/core/error.h"
#include "photosphere/core/exhaustion.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/log.h"
#include "photosphere/core/output_file.h"
#include "photosphere/volume/vdb_file.h"

namespace photosphere::cli {

void checkOutputPattern(const std::string& output, std::size_t frames) {
  if (frames < 2 || hasFrameToken(output)) return;
  const std::size_t dot = output.find_last_of("./");
  const std::string example = dot == std::string::npos || output[dot] == '/'
                                  ? output + ".####"
                                  : output.substr(0, dot) + ".####" + output.substr(dot);
  throw ConfigError(
      fmt::format("{}: {} frames would overwrite one another; add #### where the frame number "
                  "belongs (such as {})",
                  output, frames, example));
}

std::vector<std::int64_t> existingFrames(const std::string& pattern) {
  std::vector<std::int64_t> frames = findFrames(pattern);
  if (frames.empty())
    throw InputMissingError(pattern, "no file matches; check the path and its number of #");
  return frames;
}

std::vector<std::int64_t> framesByFiles(const std::string& pattern) {
  std::vector<std::int64_t> frames = existingFrames(pattern);
  const std::vector<std::int64_t> holes = missingFrames(frames);
  if (!holes.empty()) log::warning("{}: frames are missing: {}", pattern, formatFrames(holes));
  return frames;
}

void checkWritable(const std::string& path) {
  if (path.empty()) return;
  const OutputFile probe(path);  // writes nothing until it is committed
}

bool vdbIsComplete(const std::string& path) {
  std::string reason;
  std::error_code error;
  return std::filesystem::is_regular_file(path, error) && volume::probeVdb(path, reason);
}

namespace {

void runFrame(const std::string& source, std::int64_t frame,
              const std::function<void(std::int64_t)>& body) {
  try {
    body(frame);
  } catch (const Error&) {
    throw;
  } catch (const std::exception&) {
    const Resource lacking = exhausted();
    if (lacking == Resource::none) throw;
    throw MemoryError(fmt::format("{}: frame {}: {}", source, frame, remedyFor(lacking)));
  }
}

}  // namespace

int runFrames(const std::string& source, const std::vector<std::int64_t>& frames, bool keepGoing,
              const std::function<void(std::int64_t)>& body) {
  std::vector<std::int64_t> failed;
  auto report = [&](std::int64_t frame, const char* why) {
    log::error("frame {}: {}", frame, why);
    failed.push_back(frame);
  };
  for (const std::int64_t frame : frames) {
    throwIfInterrupted();
    if (!keepGoing) {
      runFrame(source, frame, body);
      continue;
    }
    try {
      runFrame(source, frame, body);
    } catch (const InterruptedError&) {
      throw;
    } catch (const std::exception& error) {
      report(frame, error.what());
    }
  }
  if (failed.empty()) return static_cast<int>(ExitCode::ok);
  log::error("{} of {} frames failed: {}", failed.size(), frames.size(), formatFrames(failed));
  return static_cast<int>(ExitCode::someFramesFailed);
}

}  // namespace photosphere::cli
