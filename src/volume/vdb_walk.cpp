#include "vdb_walk.h"

#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "photosphere/core/error.h"
#include "vdb_cursor.h"
#include "vdb_tree.h"

namespace photosphere::volume {

namespace {

constexpr std::uint64_t kMagic = 0x56444220;  // " BDV", then four zeros
constexpr std::uint32_t kOldest = 213;        // OpenVDB 0.96; older trees have no root map
constexpr std::uint32_t kNewest = 224;
constexpr std::uint32_t kGridInstancing = 216;
constexpr std::uint32_t kBoostUuid = 218;
constexpr std::uint32_t kNewTransform = 219;
constexpr std::uint32_t kSelectiveCompression = 220;
constexpr std::uint32_t kNodeMaskCompression = 222;

std::string plainName(const VdbDescriptor& grid) {
  return grid.name.substr(0, grid.name.find('\x1e'));
}

// @return whether an entry says that numbers are stored as half floats
bool walkMetadata(VdbCursor& in, const char* what) {
  bool half = false;
  const std::uint64_t at = in.position();
  const auto count = in.value<std::uint32_t>(what);
  // An entry has at least three 32-bit lengths.
  if (count > in.left() / 12)
    in.fail(at, fmt::format("{} claims {} entries, {} bytes are left", what, count, in.left()));
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string name = in.text("a metadata name");
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
    if (name == "is_saved_as_half_float" && size == 1)
      half = in.value<std::uint8_t>("a metadata value") != 0;
    in.seek(valueAt + size);
  }
  return half;
}

void walkHeader(VdbCursor& in, VdbContents& contents) {
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
std::uint64_t transformBytes(VdbCursor& in) {
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

// Goes to where the grid begins, as far as the file says that.
void seekGrid(VdbCursor& in, const VdbDescriptor& grid, std::uint64_t positionsAt) {
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
}

// Goes to the grid's end. @return whether that could be found
bool walkGrid(VdbCursor& in, const VdbContents& contents, const VdbDescriptor& grid,
              std::uint64_t positionsAt) {
  const bool instance = !grid.instance.empty();
  if (contents.hasOffsets) seekGrid(in, grid, positionsAt);
  VdbTree tree{grid.type, plainName(grid), contents.hasOffsets,
               static_cast<std::uint64_t>(grid.blockPos), static_cast<std::uint64_t>(grid.endPos)};
  tree.nodesKnown = contents.fileVersion >= kNodeMaskCompression;
  if (tree.nodesKnown) {
    const std::uint64_t at = in.position();
    tree.compression = in.value<std::uint32_t>("a grid's compression flags");
    if (tree.compression & ~kVdbCompressions)
      in.fail(at, fmt::format("unknown compression {:#x}", tree.compression));
  }
  tree.half = walkMetadata(in, "a grid's metadata");
  bool ended = false;
  if (contents.fileVersion >= kNewTransform) {
    const std::uint64_t bytes = transformBytes(in);
    if (bytes > 0) {
      in.skip(bytes, "a grid's transform");
      ended = instance || walkTree(in, tree);
    }
  }
  if (!contents.hasOffsets) return ended;
  in.seek(static_cast<std::uint64_t>(grid.endPos));
  return true;
}

}  // namespace

VdbContents walkVdb(const std::filesystem::path& path) {
  VdbCursor in(path);
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
  // Without offsets a grid begins where the walk over the one before it ended.
  bool onward = true;
  for (std::int32_t i = 0; onward && i < contents.gridCount; ++i) {
    VdbDescriptor grid;
    grid.name = in.text("a grid's name");
    grid.type = in.text("a grid's type");
    if (contents.fileVersion >= kGridInstancing) grid.instance = in.text("a grid's instance name");
    const std::uint64_t positionsAt = in.position();
    grid.gridPos = in.value<std::int64_t>("a grid's offsets");
    grid.blockPos = in.value<std::int64_t>("a grid's offsets");
    grid.endPos = in.value<std::int64_t>("a grid's offsets");
    onward = walkGrid(in, contents, grid, positionsAt);
    contents.grids.push_back(std::move(grid));
  }
  return contents;
}

}  // namespace photosphere::volume
