#pragma once
// Reads a .vdb file forward, never past its end, and knows where it is.

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace photosphere::volume {

class VdbCursor {
 public:
  /// @throws InputMissingError when it cannot be opened, InputError when it cannot be searched
  explicit VdbCursor(const std::filesystem::path& path);

  /// @throws InputError that names the byte
  [[noreturn]] void fail(std::uint64_t at, const std::string& what) const;

  /// Costs nothing until the next read. Past the end every read fails.
  void seek(std::uint64_t position) { m_position = position; }
  /// @param what  is read, for the message when the file ends before. @throws InputError
  void bytes(void* target, std::uint64_t count, const char* what);
  template <class T>
  T value(const char* what) {
    T result;
    bytes(&result, sizeof(T), what);
    return result;
  }
  /// A length of at most 65536 and as many characters.
  std::string text(const char* what);
  void skip(std::uint64_t count, const char* what) {
    need(count, what);
    m_position += count;
  }

  std::uint64_t position() const { return m_position; }
  std::uint64_t size() const { return m_size; }
  std::uint64_t left() const { return m_position < m_size ? m_size - m_position : 0; }
  const std::string& path() const { return m_path; }

 private:
  void need(std::uint64_t count, const char* what) const;
  void fillBlock(const char* what);

  std::string m_path;
  std::ifstream m_in;
  std::uint64_t m_size = 0;
  std::uint64_t m_position = 0;
  // Small reads come out of a block of the file: a stream's own buffer is lost with every seek.
  std::vector<char> m_block;
  std::uint64_t m_blockBegin = 0;
};

}  // namespace photosphere::volume
