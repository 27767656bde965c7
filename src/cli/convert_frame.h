#pragma once
// Conversion of one frame: read, place, rasterize or seed, write, report.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "placement.h"

namespace photosphere::cli {

struct ConvertOptions {
  Placement placement;
  std::string density = "density";  ///< name of the density grid that is the medium
  double radius = 0;                ///< of particles [scene units]; 0 = chosen
  bool keepStrays = false;          ///< in the density that is made of particles
  double voxelSize = 0;             ///< of the rasterized grid [scene units]; 0 = chosen
  std::uint64_t particles = 60000;  ///< seeded where there are grids only
  std::uint64_t seed = 1;
  bool allowInvalid = false;  ///< NaN, infinite and, in `density`, negative values become zero
  std::vector<std::pair<std::string, std::string>> formatOptions;  ///< name, value
};

/// Refuses format options that neither the reader of an input nor the writer has.
/// @throws ConfigError that lists those they have
void checkFormatOptions(const ConvertOptions& options, const std::vector<std::string>& inputs,
                        const std::string& output);

/// Converts the files of one frame and prints what came of it on standard output.
/// @throws Error, with nothing written
void convertFrame(const std::vector<std::string>& inputs, const std::string& output,
                  const ConvertOptions& options);

}  // namespace photosphere::cli
