#include "photosphere/core/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <numeric>
#include <unordered_map>

#include "photosphere/core/error.h"

namespace photosphere {

namespace {

constexpr std::int64_t kMaxFrames = 1'000'000;  // eleven hours at 24 a second

[[noreturn]] void badRange(std::string_view text, std::string_view part) {
  throw ConfigError(fmt::format(
      "frame range '{}': cannot read '{}' (forms: 7, 1-100, 1-100x2, 1-5y2, 5-1, -10--5, comma "
      "between them; frames up to a billion)",
      text, part));
}

// One number at the front of `rest`, which then begins after it.
bool takeNumber(std::string_view& rest, std::int64_t& value) {
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (error != std::errc()) return false;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  return value >= -1'000'000'000 && value <= 1'000'000'000;
}

struct Token {
  std::size_t begin = 0, length = 0;
  int digits = 0;
};

// The last frame token of some text.
Token lastToken(std::string_view path) {
  Token found;
  for (std::size_t i = 0; i < path.size(); ++i) {
    Token token{i, 0, 0};
    if (path[i] == '#') {
      while (i + token.length < path.size() && path[i + token.length] == '#')
        ++token.length;
      token.digits = token.length == 1 ? 4 : static_cast<int>(token.length);
    } else if (path[i] == '%' || path.substr(i, 2) == "$F") {
      std::size_t j = i + (path[i] == '%' ? 1 : 2);
      int digits = 0;
      const std::size_t start = j;
      while (j < path.size() && path[j] >= '0' && path[j] <= '9' && j - start < 3)
        digits = digits * 10 + (path[j++] - '0');
      if (path[i] == '%') {
        if (j >= path.size() || path[j] != 'd') continue;
        ++j;
      }
      token.length = j - i;
      token.digits = std::max(1, digits);
    } else {
      continue;
    }
    found = token;
    i += token.length - 1;
  }
  return found;
}

// The frame token of a path, the last one when there are several. A folder that is there under its
// very name has none in it.
Token findToken(std::string_view path) {
  const Token found = lastToken(path);
  const std::size_t slash = path.find('/', found.begin);
  if (found.length == 0 || slash == std::string_view::npos) return found;
  std::error_code error;
  const bool literal =
      std::filesystem::is_directory(std::filesystem::path(path.substr(0, slash)), error);
  return literal ? Token{} : found;
}

// Keeps the first of equal frames, and the order.
void dropRepeats(std::vector<std::int64_t>& frames) {
  std::unordered_map<std::int64_t, std::uint64_t> seen;  // 64 neighbours in one
  std::erase_if(frames, [&](std::int64_t frame) {
    std::uint64_t& neighbours = seen[frame >> 6];
    const std::uint64_t bit = std::uint64_t{1} << (frame & 63);
    const bool repeated = (neighbours & bit) != 0;
    neighbours |= bit;
    return repeated;
  });
}

}  // namespace

std::vector<std::int64_t> parseFrames(std::string_view text) {
  std::vector<std::int64_t> frames;
  std::int64_t total = 0;
  std::string compact;
  bool blank = false;
  for (const char c : text) {
    const bool digit = c >= '0' && c <= '9';
    // Numbers with nothing but blanks between them are not one.
    if (blank && digit && !compact.empty() && compact.back() >= '0' && compact.back() <= '9')
      badRange(text, text);
    blank = c == ' ' || c == '\t';
    if (!blank) compact += c;
  }
  std::string_view all = compact;
  if (all.empty()) throw ConfigError("frame range is empty (example: 1-48)");
  while (true) {
    const std::size_t comma = all.find(',');
    const std::string_view part = all.substr(0, comma);
    std::string_view rest = part;
    std::int64_t first = 0, last = 0, step = 1;
    bool complement = false;
    if (!takeNumber(rest, first)) badRange(text, part);
    last = first;
    if (!rest.empty()) {
      if (rest.front() != '-') badRange(text, part);
      rest.remove_prefix(1);
      if (!takeNumber(rest, last)) badRange(text, part);
      if (!rest.empty()) {
        complement = rest.front() == 'y';
        if (!complement && rest.front() != 'x') badRange(text, part);
        rest.remove_prefix(1);
        if (!takeNumber(rest, step) || step < 1 || !rest.empty()) badRange(text, part);
      }
    }
    const std::int64_t count = std::abs(last - first) + 1;
    total += count;
    if (total > kMaxFrames)
      throw ConfigError(fmt::format("frame range '{}': more than {} frames", text, kMaxFrames));
    const std::int64_t direction = last < first ? -1 : 1;
    for (std::int64_t i = 0; i < count; ++i) {
      if ((i % step == 0) == complement) continue;
      frames.push_back(first + i * direction);
    }
    if (comma == std::string_view::npos) break;
    all.remove_prefix(comma + 1);
  }
  if (compact.find(',') != std::string::npos) dropRepeats(frames);
  if (frames.empty()) throw ConfigError(fmt::format("frame range '{}' holds no frame", text));
  return frames;
}

std::string formatFrames(const std::vector<std::int64_t>& frames) {
  std::string text;
  for (std::size_t i = 0; i < frames.size();) {
    std::size_t run = 1;
    std::int64_t step = 0;
    if (i + 1 < frames.size()) {
      step = frames[i + 1] - frames[i];
      while (i + run < frames.size() && frames[i + run] - frames[i + run - 1] == step)
        ++run;
    }
    if (!text.empty()) text += ',';
    if (run == 1 || (run == 2 && std::abs(step) != 1)) {
      text += std::to_string(frames[i]);
      run = 1;
    } else {
      text += fmt::format("{}-{}", frames[i], frames[i + run - 1]);
      if (std::abs(step) != 1) text += fmt::format("x{}", std::abs(step));
    }
    i += run;
  }
  return text;
}

bool hasFrameToken(std::string_view path) {
  return findToken(path).length > 0;
}

std::string framePath(std::string_view path, std::int64_t frame) {
  const Token token = findToken(path);
  if (token.length == 0) return std::string(path);
  const std::string digits =
      fmt::format("{}{:0{}}", frame < 0 ? "-" : "", std::abs(frame), token.digits);
  return std::string(path.substr(0, token.begin)) + digits +
         std::string(path.substr(token.begin + token.length));
}

std::vector<std::int64_t> findFrames(std::string_view path) {
  std::vector<std::int64_t> frames;
  const Token token = findToken(path);
  if (token.length == 0) return frames;
  const std::filesystem::path pattern{std::string(path)};
  const std::filesystem::path folder =
      pattern.has_parent_path() ? pattern.parent_path() : std::filesystem::path(".");
  const std::string name = pattern.filename().string();
  const Token inName = findToken(name);
  if (inName.length == 0) return frames;
  const std::string before = name.substr(0, inName.begin);
  const std::string after = name.substr(inName.begin + inName.length);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string file = entry.path().filename().string();
    if (file.size() <= before.size() + after.size() || file.rfind(before, 0) != 0 ||
        file.compare(file.size() - after.size(), after.size(), after) != 0)
      continue;
    std::string_view middle(file);
    middle = middle.substr(before.size(), file.size() - before.size() - after.size());
    std::int64_t frame = 0;
    if (takeNumber(middle, frame) && middle.empty() && framePath(name, frame) == file)
      frames.push_back(frame);
  }
  std::sort(frames.begin(), frames.end());
  return frames;
}

std::vector<std::int64_t> missingFrames(const std::vector<std::int64_t>& frames) {
  std::int64_t step = 0;
  for (std::size_t i = 1; i < frames.size(); ++i)
    step = std::gcd(step, frames[i] - frames[i - 1]);
  std::vector<std::int64_t> holes;
  for (std::size_t i = 1; i < frames.size() && step > 0; ++i)
    for (std::int64_t frame = frames[i - 1] + step; frame < frames[i] && holes.size() < 100000;
         frame += step)
      holes.push_back(frame);
  return holes;
}

bool mapFrame(std::int64_t frame, std::int64_t first, std::int64_t last, CacheHold hold,
              std::int64_t& mapped) {
  mapped = frame;
  if (frame >= first && frame <= last) return true;
  const std::int64_t count = last - first + 1;
  switch (hold) {
    case CacheHold::clip:
      return false;
    case CacheHold::extend:
      mapped = std::clamp(frame, first, last);
      return true;
    case CacheHold::repeat:
      mapped = first + ((frame - first) % count + count) % count;
      return true;
    case CacheHold::pingpong: {
      if (count == 1) {
        mapped = first;
        return true;
      }
      const std::int64_t period = 2 * (count - 1);
      const std::int64_t phase = ((frame - first) % period + period) % period;
      mapped = first + (phase < count ? phase : period - phase);
      return true;
    }
  }
  return false;
}

}  // namespace photosphere
