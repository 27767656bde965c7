#pragma once
// The header of a PLY file (G. Turk, "The PLY Polygon File Format", 1994).

#include <cstdint>
#include <string>
#include <vector>

#include "byte_reader.h"
#include "records.h"

namespace photosphere::caches {

struct PlyProperty {
  std::string name;
  Scalar type = Scalar::f32;
  bool isList = false;
  Scalar countType = Scalar::u8;  ///< of a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  bool hasLists() const;
  /// Bytes of one element without its lists.
  std::size_t stride() const;
  /// Fewest bytes that one element can take in the file.
  std::size_t smallest(bool ascii) const;
};

struct PlyHeader {
  bool ascii = false;
  ByteOrder order = ByteOrder::little;
  std::vector<PlyElement> elements;
  std::vector<std::string> comments;

  /// Position of `vertex` in `elements`, or -1.
  int vertex() const;
};

/// Reads up to and with `end_header`. Counts are not yet checked against the file.
/// @throws InputError with the line
PlyHeader readPlyHeader(FileReader& file);

/// `float`, `uchar`, ..: the names of 1994, which every reader knows.
std::string_view plyTypeName(Scalar type);

}  // namespace photosphere::caches
