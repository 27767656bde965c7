#include "photosphere/caches/inspect.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "columns.h"
#include "inspect_warnings.h"
#include "photosphere/core/error.h"
#include "photosphere/core/frames.h"
#include "photosphere/volume/rasterize.h"
#include "photosphere/volume/vdb_file.h"

namespace photosphere::caches {

namespace fs = std::filesystem;

namespace {

constexpr double kFramesPerSecond = 24;

std::string transformKind(const volume::Grid& grid) {
  if (!grid.isAffine()) return "frustum";
  const Mat4d m = grid.worldFromIndex();
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row)
      if (row != column && m[column][row] != 0) return "affine";
  const double tolerance = 1e-6 * std::abs(m[0][0]);
  const bool cubes =
      std::abs(m[1][1] - m[0][0]) <= tolerance && std::abs(m[2][2] - m[0][0]) <= tolerance;
  return cubes ? "uniform" : "scale";
}

GridReport measureGrid(const volume::Grid& grid) {
  GridReport report;
  report.name = grid.name();
  report.type = grid.valueType();
  report.half = report.type.ends_with("(half)");
  const auto metadata = grid.metadata();
  if (const auto at = metadata.find("class"); at != metadata.end()) report.gridClass = at->second;
  report.transform = transformKind(grid);
  report.activeVoxels = grid.activeVoxels();
  report.memoryBytes = grid.memoryBytes();
  report.indexBounds = grid.activeBounds();
  report.worldBounds = grid.worldBounds();
  report.voxelSize = grid.voxelSize();
  const bool vector = grid.kind() == volume::GridKind::vector;
  if (report.activeVoxels == 0 || (!vector && grid.kind() != volume::GridKind::scalar))
    return report;
  const volume::GridStatistics values = volume::statistics(grid);
  report.hasValues = true;
  report.min = values.min;
  report.max = values.max;
  report.mean = values.mean;
  report.nans = values.nans;
  report.infinities = values.infinities;
  report.negatives = values.negatives;
  report.firstInvalid = values.firstInvalid;
  if (!vector && isDensityName(report.name) && !grid.isLevelSet())
    report.opticalDepth = volume::measureOpticalDepth(grid);
  const std::string name = lowered(report.name);
  if (vector && (name == "v" || name.find("vel") != name.npos) && report.voxelSize.x > 0)
    report.velocityVoxelsPerFrame =
        values.max / kFramesPerSecond /
        std::min({report.voxelSize.x, report.voxelSize.y, report.voxelSize.z});
  return report;
}

std::string typeName(const volume::Attribute& attribute) {
  constexpr const char* names[] = {"float", "double", "int32", "int64", "text"};
  return names[attribute.data.index()];
}

AttributeReport measureAttribute(const volume::Attribute& attribute) {
  AttributeReport report;
  report.name = attribute.name;
  report.type = typeName(attribute);
  report.arity = attribute.arity;
  double sum = 0;
  std::uint64_t finite = 0;
  std::visit(
      [&](const auto& column) {
        using Value = typename std::decay_t<decltype(column)>::value_type;
        if constexpr (std::is_arithmetic_v<Value>)
          for (const Value stored : column) {
            const double value = static_cast<double>(stored);
            if (std::isnan(value))
              ++report.nans;
            else if (std::isinf(value))
              ++report.infinities;
            else {
              report.min = finite ? std::min(report.min, value) : value;
              report.max = finite ? std::max(report.max, value) : value;
              sum += value;
              ++finite;
            }
          }
      },
      attribute.data);
  report.hasValues = finite > 0;
  if (finite > 0) report.mean = sum / static_cast<double>(finite);
  return report;
}

ParticleReport measureParticles(const volume::ParticleSet& set, const std::string& name) {
  ParticleReport report;
  report.name = name;
  report.count = set.size();
  for (const Vec3d& p : set.positions) {
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))
      report.bounds.grow(p);
    else
      ++report.invalidPositions;
  }
  if (set.size() > 1 && report.invalidPositions == 0)
    report.medianSpacing = volume::medianSpacing(set);
  for (const volume::Attribute& attribute : set.attributes)
    report.attributes.push_back(measureAttribute(attribute));
  return report;
}

void measureContent(const CacheContent& content, InspectReport& report) {
  for (const volume::Grid& grid : content.grids)
    report.grids.push_back(measureGrid(grid));
  for (std::size_t i = 0; i < content.particles.size(); ++i)
    report.particles.push_back(measureParticles(content.particles[i], content.particleNames[i]));
  for (const auto& [key, value] : content.metadata)
    report.metadata.emplace_back(key, value);
  report.notes = content.notes;
  judge(report, content);
}

}  // namespace

InspectReport inspectCache(const fs::path& path) {
  InspectReport report;
  report.path = path.string();
  try {
    const CacheFormat& format = detectFormat(path);
    report.format = format.name;
    std::error_code ignored;
    report.fileBytes = fs::file_size(path, ignored);
    if (format.name == "vdb" && !volume::probeVdb(path, report.error)) return report;
    measureContent(format.read(path, ParamValues(format.params)), report);
  } catch (const InputError& error) {
    report.error = error.what();
  }
  return report;
}

namespace {

/// What one name does over the sequence.
struct Track {
  std::vector<std::int64_t> missing;
  double smallest = 0, largest = 0;  ///< voxel size
  std::int64_t smallestFrame = 0, largestFrame = 0;
};

void followGrid(const std::string& name, SequenceReport& report) {
  Track track;
  for (std::size_t i = 0; i < report.files.size(); ++i) {
    const auto& grids = report.files[i].grids;
    const auto at = std::find_if(grids.begin(), grids.end(),
                                 [&](const GridReport& grid) { return grid.name == name; });
    if (at == grids.end()) {
      if (report.files[i].error.empty()) track.missing.push_back(report.frames[i]);
      continue;
    }
    const double size = at->voxelSize.x;
    if (track.smallest == 0 || size < track.smallest) {
      track.smallest = size;
      track.smallestFrame = report.frames[i];
    }
    if (size > track.largest) {
      track.largest = size;
      track.largestFrame = report.frames[i];
    }
  }
  if (!track.missing.empty())
    report.warnings.push_back(
        fmt::format("grid '{}' is missing in frames {}", name, formatFrames(track.missing)));
  if (track.largest > track.smallest * (1 + 1e-6))
    report.warnings.push_back(
        fmt::format("grid '{}' changes its voxel size: {:.6g} in frame {}, {:.6g} in "
                    "frame {} (an adaptive domain: frames share no lattice)",
                    name, track.smallest, track.smallestFrame, track.largest, track.largestFrame));
}

}  // namespace

SequenceReport inspectSequence(const std::string& pattern) {
  SequenceReport report;
  report.pattern = pattern;
  report.frames = findFrames(pattern);
  if (report.frames.empty())
    throw InputMissingError(pattern,
                            "no frame of this pattern exists; check its path and its number of #");
  report.holes = missingFrames(report.frames);
  if (!report.holes.empty())
    report.warnings.push_back(fmt::format("frames are missing: {}", formatFrames(report.holes)));
  std::vector<std::string> names;
  for (const std::int64_t frame : report.frames) {
    report.files.push_back(inspectCache(framePath(pattern, frame)));
    const InspectReport& file = report.files.back();
    if (!file.error.empty())
      report.warnings.push_back(fmt::format("frame {} cannot be read: {}", frame, file.error));
    for (const GridReport& grid : file.grids)
      if (std::find(names.begin(), names.end(), grid.name) == names.end())
        names.push_back(grid.name);
  }
  for (const std::string& name : names)
    followGrid(name, report);
  return report;
}

}  // namespace photosphere::caches
