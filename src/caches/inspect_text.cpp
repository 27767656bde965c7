#include <fmt/format.h>

#include "photosphere/caches/inspect.h"
#include "photosphere/core/frames.h"
#include "photosphere/core/resources.h"

namespace photosphere::caches {

namespace {

template <class V>
std::string tripleText(const V& v) {
  return fmt::format("{:.6g} {:.6g} {:.6g}", v.x, v.y, v.z);
}
std::string tripleText(const Vec3i& v) {
  return fmt::format("{} {} {}", v.x, v.y, v.z);
}

template <class B>
std::string boxText(const B& box) {
  return box.empty() ? "empty"
                     : fmt::format("({}) to ({})", tripleText(box.min), tripleText(box.max));
}

void appendGrid(std::string& text, const GridReport& grid) {
  text += fmt::format("  grid {}: {}{}{}, {} active voxels, {}\n", grid.name, grid.type,
                      grid.gridClass.empty() ? "" : ", ", grid.gridClass, grid.activeVoxels,
                      formatBytes(grid.memoryBytes));
  text += fmt::format("    index box   {}\n", boxText(grid.indexBounds));
  text += fmt::format("    world box   {}\n", boxText(grid.worldBounds));
  text += fmt::format("    voxel size  {} ({} transform)\n", tripleText(grid.voxelSize),
                      grid.transform);
  if (grid.hasValues)
    text += fmt::format(
        "    {}      min {:.6g}  max {:.6g}  mean {:.6g}  ({} NaN, {} infinite, {} "
        "negative)\n",
        grid.type.starts_with("vec") ? "length" : "values", grid.min, grid.max, grid.mean,
        grid.nans, grid.infinities, grid.negatives);
  if (grid.opticalDepth) {
    const volume::OpticalDepth& depth = *grid.opticalDepth;
    text += fmt::format(
        "    at density_scale 1: mean free path {:.3g} voxels; optical depth along axis "
        "rays 5 % {:.3g}, 50 % {:.3g}, 95 % {:.3g}\n",
        depth.meanFreePathVoxels, depth.p5, depth.median, depth.p95);
    text += fmt::format(
        "    density_scale = {:.2g} makes it look like smoke (median optical depth {:.2g})\n",
        depth.suggestedScale, volume::kSmokeDepth);
  }
  if (grid.velocityVoxelsPerFrame)
    text += fmt::format("    at 24 frames a second the fastest voxel moves {:.3g} voxels a frame\n",
                        *grid.velocityVoxelsPerFrame);
}

void appendParticles(std::string& text, const ParticleReport& set) {
  text += fmt::format("  particles {}: {}\n    world box   {}\n", set.name, set.count,
                      boxText(set.bounds));
  if (set.medianSpacing > 0)
    text += fmt::format("    spacing     {:.6g} (median)\n", set.medianSpacing);
  for (const AttributeReport& attribute : set.attributes) {
    const std::string arity = attribute.arity == 1 ? "" : fmt::format("[{}]", attribute.arity);
    text += fmt::format("    {:<11} {}{}", attribute.name, attribute.type, arity);
    if (attribute.hasValues)
      text += fmt::format("  min {:.6g}  max {:.6g}  mean {:.6g}", attribute.min, attribute.max,
                          attribute.mean);
    if (attribute.nans + attribute.infinities > 0)
      text += fmt::format("  ({} NaN, {} infinite)", attribute.nans, attribute.infinities);
    text += '\n';
  }
}

}  // namespace

std::string formatText(const InspectReport& report) {
  if (!report.error.empty()) return fmt::format("{}\n  error: {}\n", report.path, report.error);
  std::string text =
      fmt::format("{}: {}, {}\n", report.path, report.format, formatBytes(report.fileBytes));
  for (const GridReport& grid : report.grids)
    appendGrid(text, grid);
  for (const ParticleReport& set : report.particles)
    appendParticles(text, set);
  text += fmt::format("  units: {}\n", report.unitsGuess);
  for (const std::string& note : report.notes)
    text += fmt::format("  note: {}\n", note);
  for (const std::string& warning : report.warnings)
    text += fmt::format("  warning: {}\n", warning);
  return text;
}

std::string formatText(const SequenceReport& report) {
  std::string text = fmt::format("{}: {} frames, {}\n", report.pattern, report.frames.size(),
                                 formatFrames(report.frames));
  for (const InspectReport& file : report.files)
    text += formatText(file);
  for (const std::string& warning : report.warnings)
    text += fmt::format("sequence warning: {}\n", warning);
  return text;
}

}  // namespace photosphere::caches
