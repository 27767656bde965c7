#include "vdb_walk.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "photosphere/core/error.h"

namespace photosphere::volume {

static_assert(std::endian::native == std::endian::little, "the .vdb walk reads little endian");

namespace {

constexpr std::uint64_t kMagic = 0x56444220;  // " BDV", then four zeros
constexpr std::uint32_t kOldest = 213;        // OpenVDB 0.96; older trees have no root map
constexpr std::uint32_t kNewest = 224;
constexpr std::uint32_t kGridInstancing = 216;
constexpr std::uint32_t kBoostUuid = 218;
constexpr std::uint32_t kNewTransform = 219;
constexpr std::uint32_t kSelectiveCompression = 220;
constexpr std::uint32_t kNodeMaskCompression = 222;
constexpr std::uint32_t kCompressionFlags = 0x7;  // zip, active mask, blosc
constexpr std::uint32_t kLongestName = 1u << 16;

// Reads forward, never past the end, and knows where it is.
class Cursor {
 public:
  explicit Cursor(const std::filesystem::path& path) : m_path(path.string()) {
    struct stat info {};
    if (stat(m_path.c_str(), &info) != 0)
      throw InputMissingError(m_path, std::generic_category().message(errno));
    if (S_ISDIR(info.st_mode)) throw InputMissingError(m_path, "is a folder, not a .vdb file");
    m_in.open(m_path, std::ios::binary);
    if (!m_in) throw InputMissingError(m_path, std::generic_category().message(errno));
    m_in.seekg(0, std::ios::end);
    const std::streamoff size = m_in.tellg();
    if (!m_in || size < 0)
      throw InputError(m_path, "cannot be searched; copy the .vdb to a regular file first");
    m_size = static_cast<std::uint64_t>(size);
    m_in.seekg(0);
  }

  [[noreturn]] void fail(std::uint64_t at, const std::string& what) const {
    throw InputError(m_path, fmt::format("damaged .vdb: at byte {}: {}", at, what));
  }

  void seek(std::uint64_t position) {
    m_position = position;
    m_in.seekg(static_cast<std::streamoff>(position));
  }

  void bytes(void* target, std::uint64_t count, const char* what) {
    need(count, what);
    m_in.read(static_cast<char*>(target), static_cast<std::streamsize>(count));
    if (!m_in) fail(m_position, fmt::format("cannot read {}", what));
    m_position += count;
  }

  template <class T>
  T value(const char* what) {
    T result;
    bytes(&result, sizeof(T), what);
    return result;
  }

  std::string text(const char* what) {
    const std::uint64_t at = m_position;
    const auto length = value<std::uint32_t>(what);
    if (length > kLongestName || length > left())
      fail(at, fmt::format("{} has length {}, {} bytes are left", what, length, left()));
    std::string result(length, '\0');
    bytes(result.data(), length, what);
    return result;
  }

  void skip(std::uint64_t count, const char* what) {
    need(count, what);
    seek(m_position + count);
  }

  std::uint64_t position() const { return m_position; }
  std::uint64_t size() const { return m_size; }
  std::uint64_t left() const { return m_size - m_position; }
  const std::string& path() const { return m_path; }

 private:
  void need(std::uint64_t count, const char* what) const {
    if (count > left())
      fail(m_position,
           fmt::format("the file ends inside {} ({} bytes needed, {} left): it was not written to "
                       "its end or not copied whole",
                       what, count, left()));
  }

  std::string m_path;
  std::ifstream m_in;
  std::uint64_t m_size = 0;
  std::uint64_t m_position = 0;
};

std::string plainName(const VdbDescriptor& grid) {
  return grid.name.substr(0, grid.name.find('\x1e'));
}

void walkMetadata(Cursor& in, const char* what) {
  const std::uint64_t at = in.position();
  const auto count = in.value<std::uint32_t>(what);
  // An entry has at least three 32-bit lengths.
  if (count > in.left() / 12)
    in.fail(at, fmt::format("{} claims {} entries, {} bytes are left", what, count, in.left()));
  for (std::uint32_t i = 0; i < count; ++i) {
    in.text("a metadata name");
    const std::string type = in.text("a metadata type");
    const std::uint64_t sizeAt = in.position();
    const auto size = in.value<std::uint32_t>("a metadata size");
    if (size > in.left())
      in.fail(sizeAt,
              fmt::format("a metadata value of {} bytes, {} bytes are left", size, in.left()));
    const std::uint64_t valueAt = in.position();
    // OpenVDB makes room for as many leaves as this one claims; a leaf takes 64 bytes and more.
    if (type == "__delayedload" && size >= 4) {
      const auto leaves = in.value<std::uint32_t>("a leaf count");
      if (leaves > in.size() / 64)
        in.fail(valueAt, fmt::format("{} leaves in a file of {} bytes", leaves, in.size()));
    }
    in.seek(valueAt + size);
  }
}

void walkHeader(Cursor& in, VdbContents& contents) {
  if (in.size() == 0) throw InputError(in.path(), "is empty (0 bytes): its writer did not finish");
  if (in.size() < 8 || in.value<std::uint64_t>("the magic number") != kMagic)
    throw InputError(in.path(),
                     "is not a .vdb file (its first 8 bytes are not \" BDV\" and zeros)");
  contents.fileVersion = in.value<std::uint32_t>("the file version");
  if (contents.fileVersion < kOldest || contents.fileVersion > kNewest)
    in.fail(8, fmt::format("file version {}; versions {} to {} can be read", contents.fileVersion,
                           kOldest, kNewest));
  in.skip(8, "the library version");
  const std::uint64_t flagAt = in.position();
  const auto flag = in.value<std::uint8_t>("the offset flag");
  if (flag > 1) in.fail(flagAt, fmt::format("offset flag {} is neither 0 nor 1", flag));
  contents.hasOffsets = flag == 1;
  if (contents.fileVersion >= kSelectiveCompression && contents.fileVersion < kNodeMaskCompression)
    in.skip(1, "the compression flag");
  in.skip(contents.fileVersion >= kBoostUuid ? 36 : 16, "the file's UUID");
}

// Bytes that a transform takes after its type name, or 0 where that varies (frustum).
// Source: openvdb/math/Maps.h, the maps' write().
std::uint64_t transformBytes(Cursor& in) {
  static constexpr std::pair<std::string_view, std::uint64_t> maps[] = {
      {"AffineMap", 128},
      {"UnitaryMap", 128},
      {"ScaleMap", 120},
      {"UniformScaleMap", 120},
      {"TranslationMap", 24},
      {"ScaleTranslateMap", 144},
      {"UniformScaleTranslateMap", 144},
      {"NonlinearFrustumMap", 0},
  };
  const std::uint64_t at = in.position();
  const std::string type = in.text("a grid's transform type");
  for (const auto& [name, bytes] : maps)
    if (type == name) return bytes;
  in.fail(at, fmt::format("unknown transform type \"{}\"", type));
}

// Bytes of a tree's value type, or 0 when it is not one of OpenVDB's own.
std::uint64_t valueBytes(std::string_view gridType) {
  static constexpr std::pair<std::string_view, std::uint64_t> types[] = {
      {"float", 4},  {"double", 8}, {"bool", 1},   {"mask", 1},        {"int32", 4},   {"int64", 8},
      {"vec3s", 12}, {"vec3d", 24}, {"vec3i", 12}, {"ptdataidx32", 4}, {"ptidx32", 4},
  };
  for (const auto& [name, bytes] : types)
    if (gridType.starts_with(fmt::format("Tree_{}_5_4_3", name))) return bytes;
  return 0;
}

// The root's counts of tiles and children, which OpenVDB loops over even past the end of the file.
void walkRoot(Cursor& in, const VdbDescriptor& grid) {
  const std::uint64_t value = valueBytes(grid.type);
  if (value == 0) return;
  in.skip(4 + value, "a tree's background");
  const std::uint64_t at = in.position();
  const auto tiles = in.value<std::uint32_t>("a tree's size");
  const auto children = in.value<std::uint32_t>("a tree's size");
  const std::uint64_t tile = 12 + value + 1, child = 12 + 2 * 32768 / 8;  // two masks of 32^3 bits
  const std::uint64_t end = static_cast<std::uint64_t>(grid.blockPos);
  const std::uint64_t room = end > in.position() ? end - in.position() : 0;
  if (tiles * tile > room || children * child > room - tiles * tile)
    in.fail(at, fmt::format("grid \"{}\" claims {} tiles and {} nodes in {} bytes", plainName(grid),
                            tiles, children, room));
}

void walkGrid(Cursor& in, const VdbContents& contents, const VdbDescriptor& grid,
              std::uint64_t positionsAt) {
  const auto size = static_cast<std::int64_t>(in.size());
  const auto here = static_cast<std::int64_t>(in.position());
  const bool instance = !grid.instance.empty();
  const bool ordered =
      grid.gridPos >= here && grid.endPos >= grid.gridPos && grid.endPos <= size &&
      (instance || (grid.blockPos >= grid.gridPos && grid.blockPos <= grid.endPos));
  if (!ordered)
    in.fail(positionsAt,
            fmt::format("grid \"{}\" claims bytes {} to {} (voxels from {}) of a file of {} bytes: "
                        "the file was not written to its end or not copied whole",
                        plainName(grid), grid.gridPos, grid.endPos, grid.blockPos, size));
  in.seek(static_cast<std::uint64_t>(grid.gridPos));
  if (contents.fileVersion >= kNodeMaskCompression) {
    const std::uint64_t at = in.position();
    const auto flags = in.value<std::uint32_t>("a grid's compression flags");
    if (flags & ~kCompressionFlags) in.fail(at, fmt::format("unknown compression {:#x}", flags));
  }
  walkMetadata(in, "a grid's metadata");
  if (contents.fileVersion >= kNewTransform) {
    const std::uint64_t bytes = transformBytes(in);
    if (bytes > 0) {
      in.skip(bytes, "a grid's transform");
      if (!instance) walkRoot(in, grid);
    }
  }
  in.seek(static_cast<std::uint64_t>(grid.endPos));
}

}  // namespace

VdbContents walkVdb(const std::filesystem::path& path) {
  Cursor in(path);
  VdbContents contents;
  contents.fileSize = in.size();
  walkHeader(in, contents);
  walkMetadata(in, "the file's metadata");
  const std::uint64_t countAt = in.position();
  contents.gridCount = in.value<std::int32_t>("the number of grids");
  if (contents.gridCount == 0)
    throw InputError(in.path(), "holds no grids: its writer failed or had nothing to write");
  // A descriptor takes at least two lengths and three 64-bit offsets.
  if (contents.gridCount < 0 || static_cast<std::uint64_t>(contents.gridCount) > in.left() / 32)
    in.fail(countAt,
            fmt::format("{} grids in the {} bytes that are left", contents.gridCount, in.left()));
  // Without offsets the next descriptor's place is known only after the grid was decoded.
  const std::int32_t walked = contents.hasOffsets ? contents.gridCount : 1;
  for (std::int32_t i = 0; i < walked; ++i) {
    VdbDescriptor grid;
    grid.name = in.text("a grid's name");
    grid.type = in.text("a grid's type");
    if (contents.fileVersion >= kGridInstancing) grid.instance = in.text("a grid's instance name");
    const std::uint64_t positionsAt = in.position();
    grid.gridPos = in.value<std::int64_t>("a grid's offsets");
    grid.blockPos = in.value<std::int64_t>("a grid's offsets");
    grid.endPos = in.value<std::int64_t>("a grid's offsets");
    if (contents.hasOffsets) walkGrid(in, contents, grid, positionsAt);
    contents.grids.push_back(std::move(grid));
  }
  return contents;
}

}  // namespace photosphere::volume
