#pragma once
// The cache doctor: what a cache file holds, and what about it will make trouble in a render.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "photosphere/caches/cache_format.h"
#include "photosphere/core/types.h"
#include "photosphere/volume/optical_depth.h"

namespace photosphere::caches {

struct GridReport {
  std::string name, type, gridClass;
  std::string transform;  ///< uniform, scale, affine or frustum
  bool half = false;
  std::uint64_t activeVoxels = 0, memoryBytes = 0;
  Box3i indexBounds;
  Box3d worldBounds;                  ///< [scene units]
  Vec3d voxelSize{0};                 ///< [scene units]
  bool hasValues = false;             ///< false: the fields up to firstInvalid mean nothing
  double min = 0, max = 0, mean = 0;  ///< of lengths for a vector grid
  std::uint64_t nans = 0, infinities = 0, negatives = 0;
  Vec3i firstInvalid{0};                             ///< index of the first NaN or infinite voxel
  std::optional<volume::OpticalDepth> opticalDepth;  ///< of a density grid
  std::optional<double> velocityVoxelsPerFrame;      ///< longest vector at 24 frames a second
};

struct AttributeReport {
  std::string name, type;
  int arity = 1;
  bool hasValues = false;             ///< false for text and for no particles
  double min = 0, max = 0, mean = 0;  ///< over all components that are finite
  std::uint64_t nans = 0, infinities = 0;
};

struct ParticleReport {
  std::string name;
  std::uint64_t count = 0, invalidPositions = 0;
  Box3d bounds;              ///< [scene units]
  double medianSpacing = 0;  ///< distance to the nearest neighbour [scene units]; 0 = not measured
  std::vector<AttributeReport> attributes;
};

/// What one file holds.
struct InspectReport {
  std::string path, format;
  std::uint64_t fileBytes = 0;
  std::string error;  ///< why the file could not be read; the rest is empty then
  std::vector<GridReport> grids;
  std::vector<ParticleReport> particles;
  std::string unitsGuess;
  std::vector<std::pair<std::string, std::string>> metadata;
  std::vector<std::string> notes;     ///< from the reader
  std::vector<std::string> warnings;  ///< what will make trouble, with the remedy

  bool sound() const { return error.empty() && warnings.empty(); }
};

/// Reads the file and measures it. A file that is there but damaged gives a report with `error`; a
/// .vdb is first tried in a child process, so that it cannot take this one down.
/// @throws InputMissingError
InspectReport inspectCache(const std::filesystem::path& path);

/// What changes over a numbered sequence.
struct SequenceReport {
  std::string pattern;
  std::vector<std::int64_t> frames, holes;
  std::vector<InspectReport> files;   ///< one a frame
  std::vector<std::string> warnings;  ///< voxel sizes that change, grids that come and go
};

/// Inspects every frame of a pattern (core/frames.h).
/// @throws InputMissingError when no file matches
SequenceReport inspectSequence(const std::string& pattern);

/// For a terminal.
std::string formatText(const InspectReport& report);
std::string formatText(const SequenceReport& report);
/// One JSON object. Numbers that are not finite are null.
std::string formatJson(const InspectReport& report);
std::string formatJson(const SequenceReport& report);

}  // namespace photosphere::caches
