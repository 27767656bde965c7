#pragma once
// Bounded reading of binary and text files: byte order, a buffered source that knows how much is
// left.

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace photosphere::caches {

enum class ByteOrder { little, big };
/// That of .prt and .uni, on any machine.
inline constexpr ByteOrder kLittle = ByteOrder::little;

/// A number stored at `bytes` in the given order.
template <class T>
T decode(const void* bytes, ByteOrder order) {
  unsigned char raw[sizeof(T)];
  std::memcpy(raw, bytes, sizeof(T));
  if ((order == ByteOrder::little) != (std::endian::native == std::endian::little))
    std::reverse(raw, raw + sizeof(T));
  T value;
  std::memcpy(&value, raw, sizeof(T));
  return value;
}

/// Stores a number at `bytes` in the given order.
template <class T>
void encode(void* bytes, T value, ByteOrder order) {
  unsigned char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if ((order == ByteOrder::little) != (std::endian::native == std::endian::little))
    std::reverse(raw, raw + sizeof(T));
  std::memcpy(bytes, raw, sizeof(T));
}

/// IEEE 754 half to float, exact.
float floatFromHalf(std::uint16_t half);

/// A stream of bytes with a name for messages.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Reads at most `size` bytes. @return bytes read; 0 only at the end. @throws InputError
  virtual std::size_t readSome(void* data, std::size_t size) = 0;
  virtual const std::string& path() const = 0;

  /// Reads exactly `size` bytes.
  /// @param what  what is being read, for the message
  /// @throws InputError when the stream ends before
  void read(void* data, std::size_t size, std::string_view what);
  template <class T>
  T number(ByteOrder order, std::string_view what) {
    unsigned char raw[sizeof(T)];
    read(raw, sizeof(T), what);
    return decode<T>(raw, order);
  }
  /// Skips exactly `size` bytes. @throws InputError when the stream ends before
  void skip(std::uint64_t size, std::string_view what);
};

/// A file read from front to back through one buffer.
class FileReader final : public ByteSource {
 public:
  /// @throws InputMissingError when it is missing, a folder or not readable
  explicit FileReader(const std::filesystem::path& path);

  std::size_t readSome(void* data, std::size_t size) override;
  const std::string& path() const override { return m_path; }

  std::uint64_t size() const { return m_size; }
  /// Bytes after the current position.
  std::uint64_t remaining() const { return m_size > m_position ? m_size - m_position : 0; }
  std::uint64_t position() const { return m_position; }

  /// The next line without its end (LF or CRLF); valid until the next call.
  /// @return false at the end of the file
  /// @throws InputError for a line longer than 1 MiB, which no text cache has
  bool nextLine(std::string_view& line);
  /// Number of the line that nextLine gave last, from 1.
  std::uint64_t lineNumber() const { return m_line; }

 private:
  bool fill();

  std::string m_path;
  std::ifstream m_file;
  std::vector<char> m_buffer;
  std::size_t m_begin = 0, m_end = 0;
  std::uint64_t m_size = 0, m_position = 0, m_line = 0;
};

}  // namespace photosphere::caches
