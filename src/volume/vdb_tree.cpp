#include "vdb_tree.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <map>
#include <string_view>
#include <vector>

namespace photosphere::volume {

namespace {

enum class Leaf { values, bits, mask, points };

struct ValueType {
  std::string_view name;
  std::uint64_t bytes;
  std::uint64_t halfBytes;  ///< where numbers are stored as half floats
  Leaf leaf = Leaf::values;
};

constexpr ValueType kTypes[] = {
    {"float", 4, 2},
    {"double", 8, 2},
    {"int32", 4, 4},
    {"int64", 8, 8},
    {"vec3s", 12, 6},
    {"vec3d", 24, 6},
    {"vec3i", 12, 12},
    {"bool", 1, 1, Leaf::bits},
    {"mask", 1, 1, Leaf::mask},
    {"ptdataidx32", 4, 4, Leaf::points},
    {"ptidx32", 4, 4, Leaf::points},
};

const ValueType* typeOf(std::string_view gridType) {
  for (const ValueType& type : kTypes)
    if (gridType.starts_with(fmt::format("Tree_{}_5_4_3", type.name))) return &type;
  return nullptr;
}

/// One bit for each of 2^(3 Log2) children or values.
template <int Log2>
using Mask = std::array<std::uint64_t, (std::size_t{1} << (3 * Log2)) / 64>;

template <std::size_t Words>
std::uint64_t countOn(const std::array<std::uint64_t, Words>& mask) {
  std::uint64_t count = 0;
  for (const std::uint64_t word : mask)
    count += static_cast<std::uint64_t>(std::popcount(word));
  return count;
}

// What stands before the values of a node (io/Compression.h): which inactive values it has, and
// whether a mask chooses between two.
constexpr int kOneInactive = 2, kMask = 3, kMaskAndOne = 4, kMaskAndTwo = 5, kAllValues = 6;

class Walk {
 public:
  Walk(VdbCursor& in, const VdbTree& tree, const ValueType& type)
      : m_in(in), m_tree(tree), m_type(type) {}

  bool run() {
    const std::uint64_t background = 4 + m_type.bytes;  // after the number of buffers
    m_in.skip(background, "a tree's background");
    const std::uint64_t at = m_in.position();
    const auto tiles = m_in.value<std::uint32_t>("a tree's size");
    const auto children = m_in.value<std::uint32_t>("a tree's size");
    checkRoom(at, tiles, children);
    m_in.skip(tiles * tileBytes(), "a tree's tiles");
    if (!m_tree.nodesKnown) return false;
    // OpenVDB keeps nodes in the order of their origins and reads their values in it.
    std::map<std::array<std::int32_t, 3>, Counts> leaves;
    for (std::uint32_t i = 0; i < children; ++i) {
      const std::uint64_t originAt = m_in.position();
      const auto origin = m_in.value<std::array<std::int32_t, 3>>("a node's origin");
      const auto [place, fresh] = leaves.try_emplace(origin);
      if (!fresh) fail(originAt, "has two nodes at one place");
      walkInner<5>(place->second);
    }
    if (m_tree.placed && m_in.position() != m_tree.blockPos)
      fail(m_in.position(), fmt::format("has structure that does not end at byte {}, where its "
                                        "values begin",
                                        m_tree.blockPos));
    if (m_type.leaf == Leaf::points) return false;
    for (const auto& [origin, counts] : leaves)
      for (const std::uint16_t active : counts)
        walkLeaf(active);
    if (m_tree.placed && m_in.position() != m_tree.endPos)
      fail(m_in.position(),
           fmt::format("has values that do not end at byte {}, as it says", m_tree.endPos));
    return true;
  }

 private:
  using Counts = std::vector<std::uint16_t>;  // active voxels of each leaf

  [[noreturn]] void fail(std::uint64_t at, const std::string& what) const {
    m_in.fail(at, fmt::format("grid \"{}\" {}", m_tree.name, what));
  }

  std::uint64_t tileBytes() const { return 12 + m_type.bytes + 1; }

  /// OpenVDB loops over what is claimed even past the end of the file.
  void checkRoom(std::uint64_t at, std::uint64_t tiles, std::uint64_t children) const {
    const std::uint64_t child = 12 + 2 * sizeof(Mask<5>);
    const std::uint64_t end = m_tree.placed ? m_tree.blockPos : m_in.size();
    const std::uint64_t room = end > m_in.position() ? end - m_in.position() : 0;
    if (tiles * tileBytes() > room || children * child > room - tiles * tileBytes())
      fail(at, fmt::format("claims {} tiles and {} nodes in {} bytes", tiles, children, room));
  }

  template <int Log2>
  void walkInner(Counts& leaves) {
    const auto children = m_in.value<Mask<Log2>>("a node's mask");
    const auto active = m_in.value<Mask<Log2>>("a node's mask");
    walkValues(countOn(active), std::uint64_t{1} << (3 * Log2), sizeof(active));
    const std::uint64_t count = countOn(children);
    if constexpr (Log2 == 4) {
      for (std::uint64_t i = 0; i < count; ++i)
        leaves.push_back(static_cast<std::uint16_t>(countOn(m_in.value<Mask<3>>("a leaf's mask"))));
    } else {
      for (std::uint64_t i = 0; i < count; ++i)
        walkInner<Log2 - 1>(leaves);
    }
  }

  void walkLeaf(std::uint64_t active) {
    const std::uint64_t bits = sizeof(Mask<3>), origin = 12;
    if (m_type.leaf == Leaf::bits) return m_in.skip(bits + origin + bits, "a leaf's values");
    if (m_type.leaf == Leaf::mask) return m_in.skip(bits + origin, "a leaf's values");
    m_in.skip(bits, "a leaf's mask");  // once more
    walkValues(active, 512, bits);
  }

  /// The values of one node, packed or not.
  void walkValues(std::uint64_t active, std::uint64_t all, std::uint64_t maskBytes) {
    const std::uint64_t at = m_in.position();
    const int kind = m_in.value<std::int8_t>("a node's values");
    if (kind < 0 || kind > kAllValues) fail(at, fmt::format("has values of unknown kind {}", kind));
    if (kind == kOneInactive || kind == kMaskAndOne) m_in.skip(m_type.bytes, "a node's values");
    if (kind == kMaskAndTwo) m_in.skip(2 * m_type.bytes, "a node's values");
    if (kind == kMask || kind == kMaskAndOne || kind == kMaskAndTwo)
      m_in.skip(maskBytes, "a node's values");
    const bool activeOnly = (m_tree.compression & kVdbActiveMask) != 0 && kind != kAllValues;
    const std::uint64_t count = activeOnly ? active : all;
    const bool halves = m_tree.half && m_type.halfBytes != m_type.bytes;
    if (halves && count == 0) return;  // only then nothing is stored, not even a length
    walkArray(count * (halves ? m_type.halfBytes : m_type.bytes));
  }

  /// An array that holds `bytes` when unpacked: a length, negative where it is not packed.
  void walkArray(std::uint64_t bytes) {
    if ((m_tree.compression & (kVdbZip | kVdbBlosc)) == 0)
      return m_in.skip(bytes, "a node's values");
    const std::uint64_t at = m_in.position();
    const auto stored = m_in.value<std::int64_t>("a node's values");
    if (stored <= 0) {
      if (std::uint64_t{0} - static_cast<std::uint64_t>(stored) != bytes)
        fail(at, fmt::format("stores {} bytes where {} belong", stored, bytes));
      return m_in.skip(bytes, "a node's values");
    }
    const auto packed = static_cast<std::uint64_t>(stored);
    const std::uint64_t begin = m_in.position();
    m_in.skip(packed, "a node's values");
    if ((m_tree.compression & kVdbBlosc) == 0) return;
    // Blosc believes the lengths of its own header: version, flags, unpacked, block, packed.
    if (packed < 16) fail(at, fmt::format("has an array packed into {} bytes", packed));
    m_in.seek(begin + 4);
    const auto lengths = m_in.value<std::array<std::uint32_t, 3>>("a node's values");
    if (lengths[0] != bytes || lengths[2] != packed)
      fail(at, fmt::format("packs {} bytes into {} where {} into {} belong", lengths[0], lengths[2],
                           bytes, packed));
    m_in.seek(begin + packed);
  }

  VdbCursor& m_in;
  const VdbTree& m_tree;
  const ValueType& m_type;
};

}  // namespace

bool walkTree(VdbCursor& in, const VdbTree& tree) {
  const ValueType* type = typeOf(tree.type);
  return type && Walk(in, tree, *type).run();
}

}  // namespace photosphere::volume
