#include <cmath>
#include <nlohmann/json.hpp>

#include "photosphere/caches/inspect.h"

namespace photosphere::caches {

namespace {

using Json = nlohmann::ordered_json;

/// JSON has no NaN and no infinity.
Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}
Json number(std::int32_t value) {
  return value;
}

template <class V>
Json triple(const V& v) {
  return Json::array({number(v.x), number(v.y), number(v.z)});
}

template <class B>
Json boxJson(const B& box) {
  if (box.empty()) return nullptr;
  return {{"min", triple(box.min)}, {"max", triple(box.max)}};
}

Json gridJson(const GridReport& grid) {
  Json json = {{"name", grid.name},
               {"type", grid.type},
               {"class", grid.gridClass},
               {"half", grid.half},
               {"transform", grid.transform},
               {"active_voxels", grid.activeVoxels},
               {"memory_bytes", grid.memoryBytes},
               {"index_box", boxJson(grid.indexBounds)},
               {"world_box", boxJson(grid.worldBounds)},
               {"voxel_size", triple(grid.voxelSize)}};
  if (grid.hasValues) {
    json["min"] = number(grid.min);
    json["max"] = number(grid.max);
    json["mean"] = number(grid.mean);
    json["nan"] = grid.nans;
    json["infinite"] = grid.infinities;
    json["negative"] = grid.negatives;
    if (grid.nans + grid.infinities > 0) json["first_invalid"] = triple(grid.firstInvalid);
  }
  if (grid.opticalDepth) {
    const volume::OpticalDepth& depth = *grid.opticalDepth;
    json["mean_free_path_voxels"] = number(depth.meanFreePathVoxels);
    json["optical_depth"] = {
        {"p5", number(depth.p5)}, {"p50", number(depth.median)}, {"p95", number(depth.p95)}};
    json["suggested_density_scale"] = number(depth.suggestedScale);
  }
  if (grid.velocityVoxelsPerFrame)
    json["velocity_voxels_per_frame"] = number(*grid.velocityVoxelsPerFrame);
  return json;
}

Json particlesJson(const ParticleReport& set) {
  Json attributes = Json::array();
  for (const AttributeReport& attribute : set.attributes) {
    Json json = {{"name", attribute.name}, {"type", attribute.type}, {"arity", attribute.arity}};
    if (attribute.hasValues) {
      json["min"] = number(attribute.min);
      json["max"] = number(attribute.max);
      json["mean"] = number(attribute.mean);
    }
    json["nan"] = attribute.nans;
    json["infinite"] = attribute.infinities;
    attributes.push_back(std::move(json));
  }
  return {{"name", set.name},
          {"count", set.count},
          {"invalid_positions", set.invalidPositions},
          {"world_box", boxJson(set.bounds)},
          {"median_spacing", number(set.medianSpacing)},
          {"attributes", std::move(attributes)}};
}

Json reportJson(const InspectReport& report) {
  Json json = {{"path", report.path}, {"format", report.format}, {"file_bytes", report.fileBytes}};
  if (!report.error.empty()) {
    json["error"] = report.error;
    return json;
  }
  json["grids"] = Json::array();
  for (const GridReport& grid : report.grids)
    json["grids"].push_back(gridJson(grid));
  json["particles"] = Json::array();
  for (const ParticleReport& set : report.particles)
    json["particles"].push_back(particlesJson(set));
  json["units_guess"] = report.unitsGuess;
  json["metadata"] = Json::object();
  for (const auto& [key, value] : report.metadata)
    json["metadata"][key] = value;
  json["notes"] = report.notes;
  json["warnings"] = report.warnings;
  return json;
}

/// Names in a file need not be UTF-8; what is not is replaced.
std::string dump(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace

std::string formatJson(const InspectReport& report) {
  return dump(reportJson(report));
}

std::string formatJson(const SequenceReport& report) {
  Json json = {{"pattern", report.pattern}, {"frames", report.frames}, {"holes", report.holes}};
  json["files"] = Json::array();
  for (const InspectReport& file : report.files)
    json["files"].push_back(reportJson(file));
  json["warnings"] = report.warnings;
  return dump(json);
}

}  // namespace photosphere::caches
