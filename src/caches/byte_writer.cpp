#include "byte_writer.h"

#include <cerrno>

#include "photosphere/core/error.h"

namespace photosphere::caches {

ByteWriter::ByteWriter(const std::filesystem::path& path)
    : m_output(path), m_file(m_output.temporaryPath(), std::ios::binary) {
  check(m_file.is_open());
}

void ByteWriter::check(bool good) {
  if (!good)
    throw OutputError(m_output.target().string(),
                      "cannot be written: " + describeWriteError(errno));
}

void ByteWriter::write(const void* data, std::size_t size) {
  m_file.write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
  check(m_file.good());
}

void ByteWriter::patch(std::uint64_t offset, const void* data, std::size_t size) {
  m_file.seekp(static_cast<std::streamoff>(offset));
  write(data, size);
  m_file.seekp(0, std::ios::end);
  check(m_file.good());
}

void ByteWriter::commit() {
  m_file.close();
  check(!m_file.fail());
  m_output.commit();
}

}  // namespace photosphere::caches
