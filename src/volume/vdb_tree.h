#pragma once
// Walks the nodes of a tree in a .vdb file before OpenVDB does, which trusts every length there.

#include <cstdint>
#include <string>

#include "vdb_cursor.h"

namespace photosphere::volume {

inline constexpr std::uint32_t kVdbZip = 1, kVdbActiveMask = 2, kVdbBlosc = 4;
inline constexpr std::uint32_t kVdbCompressions = kVdbZip | kVdbActiveMask | kVdbBlosc;

/// What a walk must know of the grid around the tree.
struct VdbTree {
  std::string type;                        ///< of the grid, such as `Tree_float_5_4_3`
  std::string name;                        ///< of the grid, for messages
  bool placed = true;                      ///< the file says where its values are
  std::uint64_t blockPos = 0, endPos = 0;  ///< where they begin and end [bytes]
  std::uint32_t compression = 0;
  bool half = false;        ///< numbers are stored as half floats
  bool nodesKnown = false;  ///< file version 222 and later; earlier nodes are laid out otherwise
};

/// Walks from the tree's beginning to the grid's end: the counts of the root, the masks and values
/// of every node, the length of every stored array against the one that the tree needs, and whether
/// structure and values end where the grid says. OpenVDB 10 reads an array of any length into the
/// room for another (io/Compression.cc, bloscFromStream), and goes on past the end of a file.
/// Of point grids the structure is walked and the values are not; of types that are not OpenVDB's
/// own, nothing is.
/// @return whether it came to the end of the grid
/// @throws InputError naming the byte at fault
bool walkTree(VdbCursor& in, const VdbTree& tree);

}  // namespace photosphere::volume
