#pragma once
// One Mantaflow .uni file. Source: Mantaflow, source/fileio/iogrids.cpp and ioparticles.cpp
// (structs UniHeader and UniPartHeader), checked against files of Blender 3.4.1.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "photosphere/core/types.h"

namespace photosphere::caches {

enum class UniKind { grid, particles, particleData };

struct UniFile {
  std::string path;
  UniKind kind = UniKind::grid;
  Vec3i dim{0};  ///< cells of the domain
  std::int32_t gridType = 0;
  std::uint64_t count = 0;             ///< cells, or particles
  int arity = 1;                       ///< 3 for vectors
  std::vector<float> reals;            ///< `count` times `arity`; positions in cells for particles
  std::vector<std::int32_t> integers;  ///< flags of particles, or integer data
};

constexpr std::int32_t kUniMac = 8;  ///< bit of gridType: components sit on the faces

/// Reads one file. @throws InputMissingError, InputError
UniFile readUni(const std::filesystem::path& path);

/// True when a gzip stream that begins so holds a .uni grid or particles.
bool isUni(std::string_view head);

}  // namespace photosphere::caches
