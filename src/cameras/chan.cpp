#include "photosphere/cameras/chan.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "photosphere/core/error.h"
#include "photosphere/core/input_file.h"

namespace photosphere::cameras {

namespace {

constexpr std::uintmax_t kLargestFile = std::uintmax_t{64} << 20;
constexpr std::size_t kPlaceNumbers = 7;  // of a line; the field of view is the eighth

bool isBlank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

// The next word of a line, taken off its front; empty at the end.
std::string_view nextWord(std::string_view& line) {
  while (!line.empty() && isBlank(line.front()))
    line.remove_prefix(1);
  std::size_t end = 0;
  while (end < line.size() && !isBlank(line[end]))
    ++end;
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(end);
  return word;
}

Mat3d turnAbout(int axis, double degrees) {
  const double c = std::cos(degrees * kPi / 180), s = std::sin(degrees * kPi / 180);
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  Mat3d m(1.0);
  m[x][x] = m[y][y] = c;
  m[x][y] = s;
  m[y][x] = -s;
  return m;
}

// The numbers of a line and where it stands, for messages.
class Line {
 public:
  Line(std::string_view text, const std::string& name, int number) : m_name(name), m_line(number) {
    for (std::string_view word = nextWord(text); !word.empty(); word = nextWord(text)) {
      if (m_count == m_numbers.size()) complain("holds more than 8 numbers");
      m_numbers[m_count++] = numberOf(word);
    }
    if (m_count < kPlaceNumbers)
      complain(fmt::format(
          "holds {} numbers; a line is frame, translation, rotation [degrees] and perhaps a "
          "vertical field of view: 7 or 8",
          m_count));
    if (saysFov() && !(m_numbers[7] > 0 && m_numbers[7] < 180))
      complain(fmt::format("has a field of view of {} degrees; it must lie between 0 and 180",
                           m_numbers[7]));
  }

  bool saysFov() const { return m_count > kPlaceNumbers; }

  ChanKey key() const {
    const auto& n = m_numbers;
    const Mat3d r = turnAbout(1, n[5]) * turnAbout(0, n[4]) * turnAbout(2, n[6]);
    const Mat4d place(glm::dvec4(r[0], 0), glm::dvec4(r[1], 0), glm::dvec4(r[2], 0),
                      glm::dvec4(n[1], n[2], n[3], 1));
    return {n[0], place, saysFov() ? n[7] : 0.0};
  }

  [[noreturn]] void complain(const std::string& what) const {
    throw InputError(m_name, fmt::format("line {} {}", m_line, what));
  }

 private:
  double numberOf(std::string_view word) const {
    const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value))
      complain(fmt::format("holds '{}', which is no finite number", word.substr(0, 40)));
    return value;
  }

  const std::string& m_name;
  int m_line;
  std::array<double, kPlaceNumbers + 1> m_numbers{};
  std::size_t m_count = 0;
};

}  // namespace

std::vector<ChanKey> parseChan(std::string_view text, const std::string& name) {
  std::vector<ChanKey> keys;
  int number = 0;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // byte order mark of UTF-8
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++number;
    std::string_view rest = line;
    const std::string_view first = nextWord(rest);
    if (first.empty() || first.front() == '#') continue;
    const Line read(line, name, number);
    const ChanKey key = read.key();
    if (!keys.empty() && !(key.frame > keys.back().frame))
      read.complain(
          fmt::format("is of frame {}, after frame {}; every line must be of a later frame",
                      key.frame, keys.back().frame));
    if (!keys.empty() && (key.verticalFov > 0) != (keys.back().verticalFov > 0))
      read.complain("has or lacks the field of view that the lines before lack or have");
    keys.push_back(key);
  }
  if (keys.empty()) throw InputError(name, "holds no line of a camera");
  return keys;
}

std::vector<ChanKey> readChan(const std::string& path) {
  const std::uint64_t size = readableSize(path, "a .chan file");
  std::ifstream in(path, std::ios::binary);
  if (size > kLargestFile)
    throw InputError(
        path, fmt::format("is {} bytes long; a .chan file has at most {}", size, kLargestFile));
  std::string text(static_cast<std::size_t>(size), '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!in || static_cast<std::uint64_t>(in.gcount()) != size)
    throw InputMissingError(path, "cannot be read");
  return parseChan(text, path);
}

}  // namespace photosphere::cameras
