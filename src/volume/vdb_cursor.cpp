#include "vdb_cursor.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "photosphere/core/error.h"
#include "photosphere/core/input_file.h"

namespace photosphere::volume {

static_assert(std::endian::native == std::endian::little, "the .vdb walk reads little endian");

namespace {

constexpr std::uint32_t kLongestName = 1u << 16;
constexpr std::uint64_t kBlock = 1u << 16;

}  // namespace

VdbCursor::VdbCursor(const std::filesystem::path& path) : m_path(path.string()) {
  checkReadable(path, "a .vdb file");
  m_in.rdbuf()->pubsetbuf(nullptr, 0);
  m_in.open(m_path, std::ios::binary);
  if (!m_in) throw InputMissingError(m_path, "cannot be read");
  m_in.seekg(0, std::ios::end);
  const std::streamoff size = m_in.tellg();
  if (!m_in || size < 0)
    throw InputError(m_path, "cannot be searched; copy the .vdb to a regular file first");
  m_size = static_cast<std::uint64_t>(size);
}

void VdbCursor::fail(std::uint64_t at, const std::string& what) const {
  throw InputError(m_path, fmt::format("damaged .vdb: at byte {}: {}", at, what));
}

void VdbCursor::bytes(void* target, std::uint64_t count, const char* what) {
  need(count, what);
  auto* out = static_cast<char*>(target);
  while (count > 0) {
    if (m_position < m_blockBegin || m_position >= m_blockBegin + m_block.size()) fillBlock(what);
    const std::uint64_t offset = m_position - m_blockBegin;
    const std::uint64_t part = std::min<std::uint64_t>(count, m_block.size() - offset);
    std::memcpy(out, m_block.data() + offset, part);
    out += part;
    m_position += part;
    count -= part;
  }
}

void VdbCursor::fillBlock(const char* what) {
  m_block.resize(std::min(kBlock, m_size - m_position));
  m_blockBegin = m_position;
  m_in.seekg(static_cast<std::streamoff>(m_position));
  m_in.read(m_block.data(), static_cast<std::streamsize>(m_block.size()));
  if (!m_in) fail(m_position, fmt::format("cannot read {}", what));
}

std::string VdbCursor::text(const char* what) {
  const std::uint64_t at = m_position;
  const auto length = value<std::uint32_t>(what);
  if (length > kLongestName || length > left())
    fail(at, fmt::format("{} has length {}, {} bytes are left", what, length, left()));
  std::string result(length, '\0');
  bytes(result.data(), length, what);
  return result;
}

void VdbCursor::need(std::uint64_t count, const char* what) const {
  if (count > left())
    fail(m_position,
         fmt::format("the file ends inside {} ({} bytes needed, {} left): it was not written to "
                     "its end or not copied whole",
                     what, count, left()));
}

}  // namespace photosphere::volume
