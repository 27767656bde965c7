#pragma once
// Numbers in text, the same in every locale.

#include <charconv>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>

namespace photosphere::caches {

inline bool isBlank(char c) {
  return c == ' ' || c == '\t';
}

inline std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (isBlank(text.front()) || text.front() == '\r'))
    text.remove_prefix(1);
  while (!text.empty() && (isBlank(text.back()) || text.back() == '\r'))
    text.remove_suffix(1);
  return text;
}

/// Takes the next word, separated by blanks, off the front of a line; empty at the end.
inline std::string_view nextWord(std::string_view& line) {
  std::size_t begin = 0;
  while (begin < line.size() && isBlank(line[begin]))
    ++begin;
  std::size_t end = begin;
  while (end < line.size() && !isBlank(line[end]))
    ++end;
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

/// A whole word as an integer. @return false when it is none or does not fit
template <class T>
bool parseInteger(std::string_view word, T& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const auto result = std::from_chars(word.data(), word.data() + word.size(), value);
  return result.ec == std::errc() && result.ptr == word.data() + word.size();
}

/// A whole word as a real number; also `nan`, `inf` and the `1.#QNAN` of old Microsoft libraries.
/// Magnitudes beyond double become 0 or infinity.
inline bool parseReal(std::string_view word, double& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const char* const end = word.data() + word.size();
  const auto result = std::from_chars(word.data(), end, value);
  if (result.ec == std::errc() && result.ptr == end) return true;
  const bool negative = !word.empty() && word[0] == '-';
  if (result.ec == std::errc::result_out_of_range && result.ptr == end) {
    const bool tiny = word.find("e-") != word.npos || word.find("E-") != word.npos ||
                      word.find_first_of("eE") == word.npos;
    value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
    if (negative) value = -value;
    return true;
  }
  const std::string_view magnitude = negative ? word.substr(1) : word;
  if (!magnitude.starts_with("1.#")) return false;
  value = magnitude.starts_with("1.#INF") ? std::numeric_limits<double>::infinity()
                                          : std::numeric_limits<double>::quiet_NaN();
  if (negative) value = -value;
  return true;
}

/// The beginning of a word for a message: what no terminal shows is written out, as `\x00`.
inline std::string shown(std::string_view word) {
  std::string text;
  for (const char c : word.substr(0, 40)) {
    constexpr const char* kDigits = "0123456789abcdef";
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte != 0x7f)
      text += c;
    else
      text.append("\\x").append(1, kDigits[byte >> 4]).append(1, kDigits[byte & 15]);
  }
  return text;
}

/// Appends the shortest text that reads back to the same value.
template <class T>
void appendNumber(std::string& text, T value) {
  char buffer[40];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  text.append(buffer, result.ptr);
}

}  // namespace photosphere::caches
