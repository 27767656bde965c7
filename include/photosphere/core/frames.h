#pragma once
// Frame ranges and numbered paths.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace photosphere {

/// Frames of a range such as `1-100`, `1-100x2`, `1-5y2` (the frames that x2 leaves out),
/// `3,4,10-20x2`, `5-1` (downwards), `-10--5`. Order kept, repeats dropped.
/// @throws ConfigError on anything else
std::vector<std::int64_t> parseFrames(std::string_view text);

/// Shortest text that parseFrames reads back to the same list; never holds `:`.
std::string formatFrames(const std::vector<std::int64_t>& frames);

/// True when the path holds `####`, `#`, `%04d`, `%d` or `$F4`.
bool hasFrameToken(std::string_view path);

/// The path of one frame. A run of N `#` gives at least N digits, a lone `#` four; a negative frame
/// keeps its sign before the zeros (`-0010`). A path without a token comes back as it is.
std::string framePath(std::string_view path, std::int64_t frame);

/// Frames for which a file of this pattern exists, in order.
std::vector<std::int64_t> findFrames(std::string_view path);

/// Frames between the first and the last of a sequence that the common step of the others would
/// reach, 100,000 of them at most. @param frames  in order
std::vector<std::int64_t> missingFrames(const std::vector<std::int64_t>& frames);

/// What to do with a frame that lies outside the cache's range.
enum class CacheHold { clip, extend, repeat, pingpong };

/// Maps a frame into [first, last]. @return false when `clip` leaves nothing to show
bool mapFrame(std::int64_t frame, std::int64_t first, std::int64_t last, CacheHold hold,
              std::int64_t& mapped);

}  // namespace photosphere
