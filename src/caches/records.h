#pragma once
// Particles as an array of fixed-size records, the core of every binary particle format.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "byte_reader.h"
#include "photosphere/volume/particle_set.h"

namespace photosphere::caches {

enum class Scalar { i8, u8, i16, u16, i32, u32, i64, u64, f16, f32, f64 };

std::size_t scalarSize(Scalar type);
inline bool isReal(Scalar type) {
  return type >= Scalar::f16;
}

/// One number inside a record.
struct Component {
  Scalar type = Scalar::f32;
  std::size_t offset = 0;
};

/// One attribute inside a record; the channel named `P` with three components is the position.
struct Channel {
  std::string name;
  std::vector<Component> components;
  double divisor = 1;  ///< 255 for colours in bytes; any other than 1 makes the attribute float
};

struct RecordLayout {
  ByteOrder order = ByteOrder::little;
  std::size_t stride = 0;
  std::vector<Channel> channels;
};

/// Fills `records` with the next `count` records; returns how many there were.
using FetchRecords = std::function<std::size_t(unsigned char* records, std::size_t count)>;

/// Reads records in blocks of about a megabyte until `count` are there or `fetch` gives fewer than
/// it was asked for. The caller has bounded `count` and `reserve` by the size of the file.
/// @param reserve  particles to make room for at once
volume::ParticleSet readRecords(const RecordLayout& layout, std::uint64_t count,
                                std::uint64_t reserve, const FetchRecords& fetch);

/// Writes the particles as records in blocks of about a megabyte. A channel of the name of an
/// attribute takes its components; `divisor` multiplies them.
void writeRecords(const volume::ParticleSet& particles, const RecordLayout& layout,
                  const std::function<void(const unsigned char* records, std::size_t count)>& put);

/// f32 when every position is exactly one, else f64.
Scalar positionType(const volume::ParticleSet& particles);

/// The scalar type that an attribute's values have in memory (text: not to be asked).
Scalar memoryType(const volume::Attribute& attribute);

}  // namespace photosphere::caches
