#include <fmt/format.h>
#include <openvdb/io/File.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>

#include "address_room.h"
#include "crash_guard.h"
#include "openvdb_grid.h"
#include "photosphere/core/error.h"
#include "photosphere/core/exhaustion.h"
#include "photosphere/core/resources.h"
#include "photosphere/volume/vdb_file.h"
#include "vdb_walk.h"

namespace photosphere::volume {

namespace {

// A leaf of 512 voxels takes 2 to 12 KiB in memory and at least 130 bytes in the file. The walk has
// counted the nodes; what points claim to hold, nothing has, and equal points pack into a 255th
// (LZ4, which blosc uses), of which reading holds up to three copies.
constexpr std::uint64_t kLargestRatio = 1024, kRoom = std::uint64_t(256) << 20;

std::uint64_t mostFor(std::uint64_t fileSize) {
  return kRoom + kLargestRatio * fileSize;
}

std::uint64_t roomFor(std::uint64_t fileSize) {
  return std::max(kRoom, std::min(mostFor(fileSize), availableMemoryBytes()));
}

/// A tree, and what watches the memory that it was read into until that is freed.
struct WatchedTree {
  std::shared_ptr<const HeapWatch> heap;
  openvdb::TreeBase::Ptr tree;  // goes first
};

void watchTrees(const std::vector<Grid>& grids) {
  const auto heap = std::make_shared<const HeapWatch>();
  for (const Grid& grid : grids) {
    const auto watched =
        std::make_shared<WatchedTree>(WatchedTree{heap, grid.base()->baseTreePtr()});
    grid.base()->setTree(openvdb::TreeBase::Ptr(watched, watched->tree.get()));
  }
}

void load(const VdbContents& contents, VdbFile& result) {
  openvdb::io::File file(result.path);
  file.open(/*delayLoad=*/false);
  if (const auto metadata = file.getMetadata())
    for (auto it = metadata->beginMeta(); it != metadata->endMeta(); ++it)
      if (it->second) result.metadata[it->first] = it->second->str();
  const openvdb::GridPtrVecPtr grids = file.getGrids();
  if (!grids || grids->size() != static_cast<std::size_t>(contents.gridCount))
    throw InputError(result.path, fmt::format("holds {} grids where its header claims {}",
                                              grids ? grids->size() : 0, contents.gridCount));
  for (const openvdb::GridBase::Ptr& grid : *grids)
    result.grids.emplace_back(grid);
}

void checkTransforms(const VdbFile& file) {
  for (const Grid& grid : file.grids) {
    const Vec3d size = grid.voxelSize();
    bool valid = size.x > 0 && size.y > 0 && size.z > 0;
    if (grid.isAffine()) {
      const Mat4d m = grid.worldFromIndex();
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
          valid = valid && std::isfinite(m[i][j]);
      valid = valid && std::isfinite(1.0 / glm::determinant(Mat3d(m)));
    }
    if (!valid)
      throw InputError(file.path, fmt::format("{} has a transform without extent or inverse "
                                              "(voxel size {} x {} x {})",
                                              describe(grid), size.x, size.y, size.z));
  }
}

std::string listGrids(const VdbFile& file) {
  std::string list;
  for (const Grid& grid : file.grids)
    list += fmt::format("{}\"{}\" ({})", list.empty() ? "" : ", ", grid.name(), grid.valueType());
  return list;
}

}  // namespace

VdbFile readVdb(const std::filesystem::path& path) {
  const VdbContents contents = walkVdb(path);
  initializeOpenVdb();
  VdbFile result;
  result.path = path.string();
  try {
    const CrashGuard guard(path);
    const AddressRoom room(roomFor(contents.fileSize));
    load(contents, result);
    watchTrees(result.grids);
    checkTransforms(result);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    if (freeAddresses() < mostFor(contents.fileSize))
      throw MemoryError(result.path + ": " + kRanOutReading);
    throw InputError(
        result.path,
        fmt::format("asks for more memory than there is, or than its bytes can stand for ({} free, "
                    "the file has {}): the file is damaged or too large for this machine",
                    formatBytes(availableMemoryBytes()), formatBytes(contents.fileSize)));
  } catch (const std::exception& error) {
    throw InputError(result.path, fmt::format("OpenVDB cannot read it: {}", error.what()));
  }
  return result;
}

const Grid& VdbFile::find(std::string_view name) const {
  const Grid* found = nullptr;
  int count = 0;
  for (const Grid& grid : grids)
    if (grid.name() == name && count++ == 0) found = &grid;
  if (count == 1) return *found;
  if (count == 0)
    throw InputError(path, fmt::format("has no grid \"{}\"; it has {}", name, listGrids(*this)));
  throw InputError(path, fmt::format("has {} grids named \"{}\"; rename or remove all but one in "
                                     "the software that wrote it. It has {}",
                                     count, name, listGrids(*this)));
}

const Grid* VdbFile::tryFind(std::string_view name) const {
  for (const Grid& grid : grids)
    if (grid.name() == name) return &grid;
  return nullptr;
}

const Grid* VdbFile::points() const {
  for (const Grid& grid : grids)
    if (grid.kind() == GridKind::points) return &grid;
  return nullptr;
}

}  // namespace photosphere::volume
