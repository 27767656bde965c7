#pragma once
// Reads the table of contents of a .vdb file without OpenVDB, which trusts what it finds there.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace photosphere::volume {

/// One grid's entry in the file.
struct VdbDescriptor {
  std::string name;      ///< unique in the file: copies carry a suffix after the byte 0x1e
  std::string type;      ///< such as `Tree_float_5_4_3` or `Tree_float_5_4_3_HalfFloat`
  std::string instance;  ///< the grid whose tree this one shares, or empty
  std::int64_t gridPos = 0, blockPos = 0, endPos = 0;  ///< bytes from the start of the file
};

struct VdbContents {
  std::uint64_t fileSize = 0;
  std::uint32_t fileVersion = 0;
  bool hasOffsets = false;  ///< false for a file written to a pipe: positions of grids are 0
  std::int32_t gridCount = 0;
  /// All grids; of a file without offsets those before the end of one that cannot be walked.
  std::vector<VdbDescriptor> grids;
};

/// Walks header, file metadata and every grid: descriptor, metadata and tree (walkTree).
/// Layout: OpenVDB 10.0.1, io/Archive (readHeader, readGridCount), io/GridDescriptor, MetaMap.
/// @throws InputMissingError when it cannot be opened, InputError naming the byte at fault
VdbContents walkVdb(const std::filesystem::path& path);

}  // namespace photosphere::volume
