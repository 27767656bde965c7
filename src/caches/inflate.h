#pragma once
// zlib and gzip streams as byte sources, and a zlib writer.

#include <cstdint>
#include <memory>
#include <string>

#include "byte_reader.h"
#include "byte_writer.h"

namespace photosphere::caches {

/// Most bytes that a deflate stream of this size can expand to: 258 bytes from 2 bits, a ratio of
/// 1032 (zlib technical details, "Maximum Compression Factor").
inline std::uint64_t maxInflated(std::uint64_t compressed) {
  return compressed * 1032 + 1024;
}

/// Decompresses a zlib or gzip stream (told apart by its header).
class Inflate final : public ByteSource {
 public:
  explicit Inflate(ByteSource& source);
  ~Inflate() override;

  /// @throws InputError for a damaged stream, or one that ends too early
  std::size_t readSome(void* data, std::size_t size) override;
  const std::string& path() const override { return m_source.path(); }

  /// Reads on to the end of the stream, where its checksum stands.
  /// @return false when there was more data than the caller took (not read, not checked)
  /// @throws InputError for a wrong checksum or a missing end
  bool finish();

 private:
  struct State;
  ByteSource& m_source;
  std::unique_ptr<State> m_state;
};

/// Compresses to one zlib stream.
class Deflate {
 public:
  explicit Deflate(ByteWriter& file);
  ~Deflate();
  Deflate(const Deflate&) = delete;
  Deflate& operator=(const Deflate&) = delete;

  void write(const void* data, std::size_t size) { run(data, size, false); }
  /// Ends the stream; once.
  void finish() { run(nullptr, 0, true); }

 private:
  void run(const void* data, std::size_t size, bool last);

  struct State;
  ByteWriter& m_file;
  std::unique_ptr<State> m_state;
};

/// The first `size` bytes of a zlib or gzip stream of which `head` is the beginning; fewer when the
/// head is damaged or short. Never throws.
std::string inflatedHead(std::string_view head, std::size_t size);

}  // namespace photosphere::caches
