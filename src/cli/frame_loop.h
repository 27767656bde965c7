#pragma once
// The loop over frames that convert, trace and render share.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace photosphere::cli {

/// Refuses an output path that would give every frame the same name.
/// @throws ConfigError that says to add ####
void checkOutputPattern(const std::string& output, std::size_t frames);

/// Frames of a sequence of files. @throws InputMissingError when there are none
std::vector<std::int64_t> existingFrames(const std::string& pattern);

/// The same, to work on where nobody says which frames: warns of those that are missing between.
std::vector<std::int64_t> framesByFiles(const std::string& pattern);

/// Finds out before the work whether an output can be written: its folder is created, and neither
/// it nor the target refuses. An empty path is fine. @throws OutputError
void checkWritable(const std::string& path);

/// True for a .vdb that is there and can be read to its end.
bool vdbIsComplete(const std::string& path);

/// Calls `body` frame by frame. With `keepGoing` a frame that fails is reported and the others
/// follow; an interrupt always ends the loop.
/// @param source  what the frames are of, for messages
/// @return exit code: ok, or someFramesFailed
/// @throws MemoryError that names source and frame where memory or threads ran out
int runFrames(const std::string& source, const std::vector<std::int64_t>& frames, bool keepGoing,
              const std::function<void(std::int64_t)>& body);

}  // namespace photosphere::cli
