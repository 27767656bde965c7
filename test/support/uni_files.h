#pragma once
// Bytes of packed files, and Mantaflow's particles, for the tests that read them.

#include <zlib.h>

#include <cstdint>
#include <string>

namespace photosphere::test {

/// The bytes as one stream. @param windowBits  15 for zlib, 15 + 16 for gzip
inline std::string packed(const std::string& bytes, int level, int windowBits) {
  z_stream stream{};
  deflateInit2(&stream, level, Z_DEFLATED, windowBits, 8, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&stream, bytes.size()), '\0');
  std::string in = bytes;
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

/// The bytes as one gzip stream, stored or packed by its level.
inline std::string gzip(const std::string& bytes, int level = 9) {
  return packed(bytes, level, 15 + 16);
}

/// The bytes as one zlib stream.
inline std::string deflated(const std::string& bytes, int level) {
  return packed(bytes, level, 15);
}

/// Appends a value as this machine has it.
template <class T>
void put(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Particles of a `.uni` file before it is packed; number 1 is deleted.
inline std::string uniParticles(int count) {
  std::string raw = "PB02";
  for (const int value : {count, 8, 8, 8, 0, 16})
    put(raw, value);
  raw.append(264, '\0');
  for (int i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c)
      put(raw, static_cast<float>(i + c) * 0.5f);
    put(raw, i == 1 ? 1 << 10 : 1);
  }
  return raw;
}

}  // namespace photosphere::test
