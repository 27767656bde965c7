#include "uni_file.h"

#include <fmt/format.h>

#include "inflate.h"
#include "photosphere/core/error.h"

namespace photosphere::caches {

namespace {

constexpr std::size_t kGridInfo = 252, kParticleInfo = 256;
enum ElementType { kInteger = 0, kReal = 1, kVector = 2 };

[[noreturn]] void damaged(const std::string& path, const std::string& what) {
  throw InputError(path, what + ": the file is damaged; bake it again");
}

/// Cells of the domain, refused when their bytes could not be in the file.
std::uint64_t boundedCells(const UniFile& uni, std::uint64_t bytesEach, std::uint64_t room) {
  std::uint64_t cells = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t edge = uni.dim[axis];
    if (edge < 1 || cells > room / bytesEach / static_cast<std::uint64_t>(edge))
      damaged(uni.path, fmt::format("says {} x {} x {} cells, which its size does not allow",
                                    uni.dim.x, uni.dim.y, uni.dim.z));
    cells *= static_cast<std::uint64_t>(edge);
  }
  return cells;
}

void readFloats(ByteSource& source, std::vector<float>& values, std::uint64_t count) {
  values.resize(static_cast<std::size_t>(count));
  source.read(values.data(), values.size() * sizeof(float), "the values");
  for (float& value : values)
    value = decode<float>(&value, kLittle);
}

void readIntegers(ByteSource& source, std::vector<std::int32_t>& values, std::uint64_t count) {
  values.resize(static_cast<std::size_t>(count));
  source.read(values.data(), values.size() * sizeof(std::int32_t), "the values");
  for (std::int32_t& value : values)
    value = decode<std::int32_t>(&value, kLittle);
}

void readDoubles(ByteSource& source, std::vector<float>& values, std::uint64_t count) {
  values.resize(static_cast<std::size_t>(count));
  for (float& value : values)
    value = static_cast<float>(source.number<double>(kLittle, "the values"));
}

void readValues(ByteSource& source, UniFile& uni, std::int32_t bytesEach) {
  const std::uint64_t values = uni.count * static_cast<std::uint64_t>(uni.arity);
  if (bytesEach == 8 * uni.arity)
    readDoubles(source, uni.reals, values);
  else
    readFloats(source, uni.reals, values);
}

void readGrid(ByteSource& source, UniFile& uni, std::uint64_t room) {
  for (int axis = 0; axis < 3; ++axis)
    uni.dim[axis] = source.number<std::int32_t>(kLittle, "the header");
  uni.gridType = source.number<std::int32_t>(kLittle, "the header");
  const auto type = source.number<std::int32_t>(kLittle, "the header");
  const auto bytesEach = source.number<std::int32_t>(kLittle, "the header");
  source.skip(kGridInfo, "the header");
  const auto dimT = source.number<std::int32_t>(kLittle, "the header");
  source.skip(8, "the header");
  if (dimT > 1)
    damaged(uni.path, fmt::format("is a grid of {} time steps, which is not read", dimT));
  uni.arity = type == kVector ? 3 : 1;
  const bool known = type == kInteger
                         ? bytesEach == 4
                         : (type == kReal || type == kVector) &&
                               (bytesEach == 4 * uni.arity || bytesEach == 8 * uni.arity);
  if (!known)
    damaged(uni.path, fmt::format("has elements of type {} and {} bytes", type, bytesEach));
  uni.count = boundedCells(uni, static_cast<std::uint64_t>(bytesEach), room);
  if (type == kInteger)
    readIntegers(source, uni.integers, uni.count);
  else
    readValues(source, uni, bytesEach);
}

/// Header of particles and of their data; returns the bytes of one element.
std::int32_t readParticleHeader(ByteSource& source, UniFile& uni, std::int32_t& type) {
  const auto count = source.number<std::int32_t>(kLittle, "the header");
  for (int axis = 0; axis < 3; ++axis)
    uni.dim[axis] = source.number<std::int32_t>(kLittle, "the header");
  type = source.number<std::int32_t>(kLittle, "the header");
  const auto bytesEach = source.number<std::int32_t>(kLittle, "the header");
  source.skip(kParticleInfo + 8, "the header");
  if (count < 0) damaged(uni.path, fmt::format("says {} particles", count));
  uni.count = static_cast<std::uint64_t>(count);
  return bytesEach;
}

void boundParticles(const UniFile& uni, std::int32_t bytesEach, std::uint64_t room) {
  if (uni.count > room / static_cast<std::uint64_t>(bytesEach))
    damaged(uni.path, fmt::format("says {} particles, which its size does not allow", uni.count));
}

void readParticles(ByteSource& source, UniFile& uni, std::uint64_t room) {
  std::int32_t type = 0;
  const std::int32_t bytesEach = readParticleHeader(source, uni, type);
  if (bytesEach != 16) damaged(uni.path, fmt::format("has particles of {} bytes", bytesEach));
  boundParticles(uni, bytesEach, room);
  uni.arity = 3;
  uni.reals.reserve(static_cast<std::size_t>(uni.count) * 3);
  uni.integers.reserve(static_cast<std::size_t>(uni.count));
  for (std::uint64_t i = 0; i < uni.count; ++i) {
    unsigned char record[16];
    source.read(record, sizeof record, "the particles");
    for (int c = 0; c < 3; ++c)
      uni.reals.push_back(decode<float>(record + 4 * c, kLittle));
    uni.integers.push_back(decode<std::int32_t>(record + 12, kLittle));
  }
}

/// The element type in the header says "real" even for vectors, so the size decides.
void readParticleData(ByteSource& source, UniFile& uni, std::uint64_t room) {
  std::int32_t type = 0;
  const std::int32_t bytesEach = readParticleHeader(source, uni, type);
  if (bytesEach != 4 && bytesEach != 12)
    damaged(uni.path, fmt::format("has particle data of {} bytes", bytesEach));
  boundParticles(uni, bytesEach, room);
  uni.arity = bytesEach / 4;
  const std::uint64_t values = uni.count * static_cast<std::uint64_t>(uni.arity);
  if (type == kInteger)
    readIntegers(source, uni.integers, values);
  else
    readFloats(source, uni.reals, values);
}

}  // namespace

bool isUni(std::string_view head) {
  if (!head.starts_with("\x1F\x8B")) return false;
  const std::string tag = inflatedHead(head, 4);
  for (const std::string_view known : {"MNT3", "M4T3", "MNT2", "MNT1", "DDF2", "PB02", "PD01"})
    if (tag == known) return true;
  return false;
}

UniFile readUni(const std::filesystem::path& path) {
  FileReader file(path);
  const std::uint64_t room = maxInflated(file.size());
  Inflate source(file);
  UniFile uni;
  uni.path = file.path();
  char tag[4];
  source.read(tag, 4, "the header");
  const std::string_view kind(tag, 4);
  if (kind == "MNT3") {
    readGrid(source, uni, room);
  } else if (kind == "PB02") {
    uni.kind = UniKind::particles;
    readParticles(source, uni, room);
  } else if (kind == "PD01") {
    uni.kind = UniKind::particleData;
    readParticleData(source, uni, room);
  } else if (kind == "M4T3" || kind.starts_with("MNT") || kind == "DDF2") {
    throw InputError(uni.path,
                     fmt::format("is Mantaflow's {} (four-dimensional or of an old version), "
                                 "which is not read; bake again as OpenVDB",
                                 kind));
  } else {
    throw InputError(uni.path,
                     "is not a Mantaflow grid or particle file (Blender's config_####.uni "
                     "holds settings only); name density_####.uni or pp_####.uni");
  }
  if (!source.finish()) damaged(uni.path, "holds more data than its header says");
  return uni;
}

}  // namespace photosphere::caches
