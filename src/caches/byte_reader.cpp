#include "byte_reader.h"

#include <fmt/format.h>

#include <cmath>

#include "photosphere/core/error.h"
#include "photosphere/core/input_file.h"

namespace photosphere::caches {

namespace fs = std::filesystem;

namespace {
constexpr std::size_t kBuffer = std::size_t(1) << 18;
constexpr std::size_t kLongestLine = std::size_t(1) << 20;
}  // namespace

float floatFromHalf(std::uint16_t half) {
  const std::uint32_t sign = (half & 0x8000u) << 16;
  const std::uint32_t exponent = (half >> 10) & 0x1fu;
  const std::uint32_t fraction = half & 0x3ffu;
  if (exponent == 0) {
    const float magnitude = std::ldexp(static_cast<float>(fraction), -24);
    return sign ? -magnitude : magnitude;
  }
  const std::uint32_t wide = exponent == 31 ? 255u : exponent + 112u;
  return std::bit_cast<float>(sign | (wide << 23) | (fraction << 13));
}

void ByteSource::read(void* data, std::size_t size, std::string_view what) {
  auto* out = static_cast<char*>(data);
  std::size_t done = 0;
  while (done < size) {
    const std::size_t got = readSome(out + done, size - done);
    if (got == 0)
      throw InputError(path(),
                       fmt::format("ends inside {}: the file is truncated; write it again", what));
    done += got;
  }
}

void ByteSource::skip(std::uint64_t size, std::string_view what) {
  char scratch[4096];
  while (size > 0) {
    const std::size_t part =
        static_cast<std::size_t>(std::min<std::uint64_t>(size, sizeof scratch));
    read(scratch, part, what);
    size -= part;
  }
}

FileReader::FileReader(const fs::path& path) : m_path(path.string()) {
  m_size = readableSize(path, "a cache file");
  m_buffer.resize(static_cast<std::size_t>(std::min<std::uint64_t>(m_size + 1, kBuffer)));
  m_file.rdbuf()->pubsetbuf(nullptr, 0);  // this class buffers
  m_file.open(path, std::ios::binary);
  if (!m_file) throw InputMissingError(m_path, "cannot be read");
}

bool FileReader::fill() {
  if (m_begin > 0) {
    std::memmove(m_buffer.data(), m_buffer.data() + m_begin, m_end - m_begin);
    m_end -= m_begin;
    m_begin = 0;
  }
  if (m_end == m_buffer.size()) m_buffer.resize(m_buffer.size() * 2);
  m_file.read(m_buffer.data() + m_end, static_cast<std::streamsize>(m_buffer.size() - m_end));
  if (m_file.bad()) throw InputError(m_path, "read error on the device");
  const std::size_t got = static_cast<std::size_t>(m_file.gcount());
  m_end += got;
  return got > 0;
}

std::size_t FileReader::readSome(void* data, std::size_t size) {
  if (m_begin == m_end && !fill()) return 0;
  const std::size_t part = std::min(size, m_end - m_begin);
  std::memcpy(data, m_buffer.data() + m_begin, part);
  m_begin += part;
  m_position += part;
  return part;
}

bool FileReader::nextLine(std::string_view& line) {
  std::size_t searched = 0;
  const char* newline = nullptr;
  for (;;) {
    const std::size_t held = m_end - m_begin;
    newline = held > searched ? static_cast<const char*>(std::memchr(
                                    m_buffer.data() + m_begin + searched, '\n', held - searched))
                              : nullptr;
    if (newline) break;
    if (held > kLongestLine)
      throw InputError(m_path,
                       fmt::format("line {} is longer than 1 MiB: not a text cache", m_line + 1));
    searched = held;
    if (!fill()) break;
  }
  const char* begin = m_buffer.data() + m_begin;
  const std::size_t length = newline ? static_cast<std::size_t>(newline - begin) : m_end - m_begin;
  if (!newline && length == 0) return false;
  line = std::string_view(begin, length);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  const std::size_t consumed = length + (newline ? 1 : 0);
  m_begin += consumed;
  m_position += consumed;
  ++m_line;
  return true;
}

}  // namespace photosphere::caches
