#pragma once
// Little-endian reads from a file, each checked against its size.

#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "photosphere/core/error.h"
#include "photosphere/core/input_file.h"

namespace photosphere::image {

static_assert(std::endian::native == std::endian::little, "EXR is read as little-endian");

class ExrBytes {
 public:
  explicit ExrBytes(const std::filesystem::path& path) : m_path(path.string()) {
    m_size = readableSize(path, "an EXR file");
    m_in.open(path, std::ios::binary);
    if (!m_in) throw InputMissingError(m_path, "cannot be read");
  }

  std::uint64_t size() const { return m_size; }
  std::uint64_t position() const { return m_position; }
  std::uint64_t left() const { return m_size - m_position; }

  void seek(std::uint64_t position) {
    if (position > m_size) cutShort();
    m_position = position;
    m_in.seekg(static_cast<std::streamoff>(position));
  }

  void read(void* into, std::uint64_t bytes) {
    if (bytes > left()) cutShort();
    if (!m_in.read(static_cast<char*>(into), static_cast<std::streamsize>(bytes))) cutShort();
    m_position += bytes;
  }

  template <class T>
  T value() {
    T result;
    read(&result, sizeof(T));
    return result;
  }

  /// A zero-terminated string of at most 255 bytes, the longest name that the format allows.
  std::string name() {
    std::string text;
    for (char c = value<char>(); c != '\0'; c = value<char>()) {
      text += c;
      if (text.size() > 255) damaged("a name in its header is too long");
    }
    return text;
  }

  [[noreturn]] void damaged(const std::string& what) const {
    throw InputError(m_path, "not a sound EXR file: " + what + "; write or copy it again");
  }
  [[noreturn]] void cutShort() const { damaged("it ends too early"); }

 private:
  std::string m_path;
  std::ifstream m_in;
  std::uint64_t m_size = 0;
  std::uint64_t m_position = 0;
};

}  // namespace photosphere::image
