// --stats and plans as JSON.

#include <nlohmann/json.hpp>

#include "photosphere/core/version.h"
#include "photosphere/scene/plan.h"

namespace photosphere::scene {

namespace {

// The library writes numbers that are not finite as null.
nlohmann::ordered_json channels(const Vec3d& v) {
  return {v.x, v.y, v.z};
}

nlohmann::ordered_json effectsJson(const std::vector<EffectState>& effects) {
  auto json = nlohmann::ordered_json::object();
  for (const EffectState& effect : effects) {
    json[effect.name] = {{"on", effect.on}, {"why", effect.why}, {"bound", nullptr}};
    if (effect.bound) json[effect.name]["bound"] = *effect.bound;
  }
  return json;
}

// Names come from files and need not be UTF-8.
std::string text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

std::string statsJson(const FrameStatistics& s) {
  nlohmann::ordered_json json;
  json["seconds"] = {{"read", s.seconds.read},   {"rasterize", s.seconds.rasterize},
                     {"trace", s.seconds.trace}, {"resolve", s.seconds.resolve},
                     {"march", s.seconds.march}, {"write", s.seconds.write},
                     {"total", s.seconds.total}};
  if (s.seconds.check > 0) json["seconds"]["check"] = s.seconds.check;
  json["cpu_seconds"] = s.cpuSeconds;
  json["peak_memory_bytes"] = s.peakMemoryBytes;
  json["photons"] = {{"emitted", s.photonsEmitted},
                     {"scattered", s.photonsScattered},
                     {"stored", s.photonsStored},
                     {"capped", s.photonsCapped}};
  json["light_memory_bytes"] = s.lightMemoryBytes;
  json["energy_watts"] = {
      {"emitted", channels(s.energyEmitted)},   {"missed", channels(s.energyMissed)},
      {"absorbed", channels(s.energyAbsorbed)}, {"escaped", channels(s.energyEscaped)},
      {"capped", channels(s.energyCapped)},     {"error", channels(s.energyError)}};
  json["nan_samples"] = s.nanSamples;
  json["negative_samples"] = s.negativeSamples;
  json["majorant_violations"] = s.majorantViolations;
  if (s.pathsCapped > 0)
    json["paths_capped"] = {{"count", s.pathsCapped}, {"throughput", s.pathsCappedRadiance}};
  if (s.error)
    json["error"] = {{"estimate", s.error->total()}, {"noise", s.error->noise},
                     {"bias", s.error->bias},        {"doubt", s.error->doubt},
                     {"batches", s.batches},         {"target_missed", s.targetMissed}};
  if (s.negativeLight > 0) json["negative_light"] = s.negativeLight;
  json["effects"] = effectsJson(s.effects);
  json["image"] = {{"mean", s.imageMean}, {"max", s.imageMax}};
  json["version"] = versionText();
  json["scene_hash"] = s.sceneHash;
  return text(json) + "\n";
}

std::string planJson(const FramePlan& plan) {
  nlohmann::ordered_json json;
  json["frame"] = plan.frame;
  json["resolution"] = {plan.resolution.x, plan.resolution.y};
  json["estimator"] = plan.estimator;
  json["layout"] = plan.layout;
  json["effects"] = effectsJson(plan.effects);
  const StageSeconds& s = plan.seconds;
  json["seconds"] = {{"read", s.read},       {"rasterize", s.rasterize}, {"trace", s.trace},
                     {"resolve", s.resolve}, {"march", s.march},         {"total", s.total}};
  const FrameMemory& m = plan.memory;
  json["memory_bytes"] = {{"smoke", m.smoke},     {"light", m.light},
                          {"shadows", m.shadows}, {"pixels", m.pixels},
                          {"total", m.total()},   {"budget", plan.memoryBudget}};
  json["notes"] = plan.notes;
  return text(json);
}

}  // namespace photosphere::scene
