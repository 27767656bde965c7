#include "inflate.h"

#include <zlib.h>

#include <fmt/format.h>

#include <array>

#include "photosphere/core/error.h"

namespace photosphere::caches {

namespace {
constexpr std::size_t kChunk = std::size_t(1) << 16;
constexpr int kDetectHeader = 15 + 32;
}  // namespace

struct Inflate::State {
  z_stream stream{};
  std::array<unsigned char, kChunk> input;
  bool ended = false;
};

Inflate::Inflate(ByteSource& source) : m_source(source), m_state(std::make_unique<State>()) {
  if (inflateInit2(&m_state->stream, kDetectHeader) != Z_OK)
    throw MemoryError(path() + ": no memory to decompress");
}

Inflate::~Inflate() {
  inflateEnd(&m_state->stream);
}

std::size_t Inflate::readSome(void* data, std::size_t size) {
  z_stream& stream = m_state->stream;
  if (m_state->ended || size == 0) return 0;
  const uInt wanted = static_cast<uInt>(std::min<std::size_t>(size, std::size_t(1) << 30));
  stream.next_out = static_cast<Bytef*>(data);
  stream.avail_out = wanted;
  while (stream.avail_out == wanted) {
    if (stream.avail_in == 0) {
      const std::size_t got = m_source.readSome(m_state->input.data(), kChunk);
      if (got == 0)
        throw InputError(path(),
                         "its compressed data ends too early: the file is truncated; write "
                         "it again");
      stream.next_in = m_state->input.data();
      stream.avail_in = static_cast<uInt>(got);
    }
    const int status = inflate(&stream, Z_NO_FLUSH);
    if (status == Z_STREAM_END) {
      m_state->ended = true;
      break;
    }
    if (status != Z_OK && status != Z_BUF_ERROR)
      throw InputError(path(), fmt::format("its compressed data is damaged ({}); write it again",
                                           stream.msg ? stream.msg : "zlib error"));
  }
  return wanted - stream.avail_out;
}

bool Inflate::finish() {
  char more;
  return readSome(&more, 1) == 0;
}

struct Deflate::State {
  z_stream stream{};
  std::array<unsigned char, kChunk> output;
};

Deflate::Deflate(ByteWriter& file) : m_file(file), m_state(std::make_unique<State>()) {
  if (deflateInit(&m_state->stream, Z_BEST_SPEED) != Z_OK)
    throw MemoryError("no memory to compress");
}

Deflate::~Deflate() {
  deflateEnd(&m_state->stream);
}

void Deflate::run(const void* data, std::size_t size, bool last) {
  z_stream& stream = m_state->stream;
  stream.next_in = static_cast<Bytef*>(const_cast<void*>(data));
  stream.avail_in = static_cast<uInt>(size);
  do {
    stream.next_out = m_state->output.data();
    stream.avail_out = kChunk;
    deflate(&stream, last ? Z_FINISH : Z_NO_FLUSH);
    m_file.write(m_state->output.data(), kChunk - stream.avail_out);
  } while (stream.avail_out == 0);
}

std::string inflatedHead(std::string_view head, std::size_t size) {
  std::string out(size, '\0');
  z_stream stream{};
  if (inflateInit2(&stream, kDetectHeader) != Z_OK) return {};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(head.data()));
  stream.avail_in = static_cast<uInt>(head.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(size);
  inflate(&stream, Z_SYNC_FLUSH);
  out.resize(size - stream.avail_out);
  inflateEnd(&stream);
  return out;
}

}  // namespace photosphere::caches
