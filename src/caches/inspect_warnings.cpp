#include "inspect_warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "columns.h"
#include "text_number.h"

namespace photosphere::caches {

namespace {

constexpr double kLargeBox = 1000;  // units; no room or fire is a kilometre long
constexpr double kSmallBox = 0.01;
constexpr double kFarInSizes = 1e5;  // box diagonals from the origin: float positions step visibly

std::string metadataOf(const CacheContent& content, const std::string& key) {
  if (const auto at = content.metadata.find(key); at != content.metadata.end()) return at->second;
  for (const volume::Grid& grid : content.grids) {
    const auto metadata = grid.metadata();
    if (const auto at = metadata.find(key); at != metadata.end()) return at->second;
  }
  return {};
}

/// Blender names itself in some versions only, but always leaves its domain's resolution.
bool isBlender(const CacheContent& content) {
  return lowered(metadataOf(content, "creator")).find("blender") != std::string::npos ||
         !metadataOf(content, "file_base_resolution").empty();
}

Box3d wholeBox(const InspectReport& report) {
  Box3d box;
  for (const GridReport& grid : report.grids)
    box.grow(grid.worldBounds);
  for (const ParticleReport& set : report.particles)
    box.grow(set.bounds);
  return box;
}

std::string guessUnits(const InspectReport& report, const CacheContent& content) {
  double metres = 0;
  if (parseReal(metadataOf(content, "LengthUnitInMeters"), metres) && metres > 0)
    return fmt::format("1 unit = {:.6g} m (the file says so): meters_per_unit = {:.6g}", metres,
                       metres);
  if (isBlender(content)) return "metres (Blender's default)";
  const std::string creator = lowered(metadataOf(content, "creator"));
  if (creator.find("houdini") != creator.npos) return "metres (Houdini's default)";
  if (report.format == "uni") return "none in the file (set voxel_size)";
  const Box3d box = wholeBox(report);
  if (box.empty()) return "unknown (nothing with an extent)";
  const double size = maxComponent(box.extent());
  if (size == 0) return "unknown (nothing with an extent)";
  if (size > kLargeBox)
    return fmt::format(
        "centimetres or millimetres, as the box is {:.6g} units long: meters_per_unit = "
        "0.01 or 0.001",
        size);
  if (size < kSmallBox)
    return fmt::format("larger than metres, as the box is {:.6g} units long", size);
  return "metres are plausible";
}

/// `[4, 0, 0]` of file_bbox metadata.
bool parseCorner(const std::string& text, Vec3i& corner) {
  std::string plain = text;
  std::replace_if(
      plain.begin(), plain.end(), [](char c) { return c == '[' || c == ']' || c == ','; }, ' ');
  std::string_view rest = plain;
  for (int axis = 0; axis < 3; ++axis)
    if (!parseInteger(nextWord(rest), corner[axis])) return false;
  return true;
}

bool storedBoxInverted(const volume::Grid& grid) {
  const auto metadata = grid.metadata();
  const auto low = metadata.find("file_bbox_min"), high = metadata.find("file_bbox_max");
  Vec3i min, max;
  return low != metadata.end() && high != metadata.end() && parseCorner(low->second, min) &&
         parseCorner(high->second, max) && (max.x < min.x || max.y < min.y || max.z < min.z);
}

void judgeGrid(const GridReport& grid, const volume::Grid& source, std::vector<std::string>& out) {
  const auto warn = [&](const std::string& text) {
    out.push_back(fmt::format("grid '{}' {}", grid.name, text));
  };
  if (grid.activeVoxels == 0) {
    warn(storedBoxInverted(source) ? "is empty (no active voxels; its stored box is inverted)"
                                   : "is empty (no active voxels)");
    return;
  }
  if (storedBoxInverted(source)) warn("has an inverted stored box; its voxels tell another");
  if (grid.nans + grid.infinities > 0)
    warn(fmt::format(
        "has {} NaN and {} infinite voxels, the first at index ({}, {}, {}); remove them in "
        "the software that wrote it",
        grid.nans, grid.infinities, grid.firstInvalid.x, grid.firstInvalid.y, grid.firstInvalid.z));
  if (source.isLevelSet()) warn("is a level set, distances from a surface; export a fog volume");
  if (grid.negatives > 0 && isDensityName(grid.name) && !source.isLevelSet())
    warn(fmt::format("has {} voxels of negative density (down to {:.6g})", grid.negatives,
                     grid.min));
  if (grid.hasValues && isDensityName(grid.name) && grid.max <= 0) warn("has no density above 0");
  if (grid.transform == "frustum")
    warn("has a frustum transform, which is not rendered; resample it");
  if (grid.gridClass == "staggered")
    warn("is staggered (MAC): each component lies on its face, half a voxel from the centre");
  const double low = std::min({grid.voxelSize.x, grid.voxelSize.y, grid.voxelSize.z});
  if (maxComponent(grid.voxelSize) > low * 1.001)
    warn(fmt::format("has voxels that are no cubes ({:.6g} x {:.6g} x {:.6g})", grid.voxelSize.x,
                     grid.voxelSize.y, grid.voxelSize.z));
}

void judgeParticles(const ParticleReport& set, std::vector<std::string>& out) {
  const auto warn = [&](const std::string& text) {
    out.push_back(fmt::format("particles '{}': {}", set.name, text));
  };
  if (set.count == 0) return warn("none");
  if (set.invalidPositions > 0)
    warn(fmt::format("{} positions are not finite", set.invalidPositions));
  if (set.count > 1 && maxComponent(set.bounds.extent()) == 0) warn("all at one place");
  for (const AttributeReport& attribute : set.attributes) {
    if (attribute.nans + attribute.infinities > 0)
      warn(fmt::format("attribute '{}' has {} NaN and {} infinite values", attribute.name,
                       attribute.nans, attribute.infinities));
    if (attribute.hasValues && (attribute.name == "pscale" || attribute.name == "mass") &&
        attribute.min <= 0)
      warn(fmt::format("attribute '{}' goes down to {:.6g}; such particles carry no smoke",
                       attribute.name, attribute.min));
  }
}

void judgeFile(InspectReport& report, const CacheContent& content) {
  std::map<std::string, int> names;
  for (const GridReport& grid : report.grids)
    ++names[grid.name];
  for (const ParticleReport& set : report.particles)
    ++names[set.name];
  for (const auto& [name, count] : names)
    if (count > 1)
      report.warnings.push_back(
          fmt::format("{} grids are named '{}'; a scene cannot choose one by name", count, name));
  if (report.grids.empty() && report.particles.empty())
    report.warnings.push_back("holds neither grids nor particles");
  const Box3d box = wholeBox(report);
  if (maxComponent(box.extent()) > 0 &&
      glm::length(box.center()) > kFarInSizes * glm::length(box.extent()))
    report.warnings.push_back(
        "lies so far from the origin for its size that float positions show steps");
  const bool corner =
      std::any_of(content.grids.begin(), content.grids.end(), [](const volume::Grid& g) {
        return g.isAffine() && Vec3d(g.worldFromIndex()[3]) != Vec3d(0);
      });
  if (isBlender(content) && !content.grids.empty() && !corner)
    report.warnings.push_back(
        "Blender leaves out where the domain lies: give its lowest corner plus half "
        "a voxel as the volume's translation");
}

}  // namespace

bool isDensityName(std::string_view name) {
  const std::string lower = lowered(name);
  for (const char* word : {"density", "smoke", "soot", "fog"})
    if (lower.find(word) != lower.npos) return true;
  return false;
}

void judge(InspectReport& report, const CacheContent& content) {
  report.unitsGuess = guessUnits(report, content);
  for (std::size_t i = 0; i < report.grids.size(); ++i)
    judgeGrid(report.grids[i], content.grids[i], report.warnings);
  for (const ParticleReport& set : report.particles)
    judgeParticles(set, report.warnings);
  judgeFile(report, content);
}

}  // namespace photosphere::caches
