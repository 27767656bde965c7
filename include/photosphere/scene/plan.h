#pragma once
// What a frame would simulate, and what it would cost (`photosphere plan`).

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "photosphere/scene/pipeline.h"

namespace photosphere::scene {

/// Bytes that a frame needs at its peak, by what holds them.
struct FrameMemory {
  std::uint64_t smoke = 0;    ///< density, albedo, emission, majorants
  std::uint64_t light = 0;    ///< light field or photon map
  std::uint64_t shadows = 0;  ///< shadow grids; 0 before they are made
  std::uint64_t pixels = 0;
  std::uint64_t total() const { return smoke + light + shadows + pixels; }
};

/// Before anything is traced. @see checkMemory
FrameMemory predictedMemory(const FrameSetup& setup, bool storedLight);

/// A frame's plan.
struct FramePlan {
  std::int64_t frame = 0;
  Vec2i resolution{0};
  std::string estimator;             ///< estimator.type
  std::string layout;                ///< how light is stored; empty where none is
  Box3d smoke;                       ///< [scene units]; may be empty
  std::vector<EffectState> effects;  ///< in the order of [effects], then `lights`, `directions`
  StageSeconds seconds;              ///< predicted; `write` and `check` are 0
  FrameMemory memory;                ///< predicted
  std::uint64_t memoryBudget = 0;    ///< 0 = no limit
  std::vector<std::string> notes;
};

/// Sets a frame up as `renderScene` does, and predicts its seconds on this machine from short
/// pieces of the work: as many photons as take some tenths of a second, the resolve of their light,
/// shadow grids as they will be, and small crops spread over the frame. Reading is measured. The
/// time of a frame with a target error is that of the parts that its error is judged by.
/// @throws what renderScene throws before it traces
FramePlan planScene(const SceneFile& scene, std::int64_t frame, const RenderRequest& request = {});

/// One line: `single_scattering, shadows; off: emission (no volume emits), ...`.
std::string planLine(std::span<const EffectState> effects);

/// JSON object without a final newline: `frame`, `resolution`, `estimator`, `layout`, `effects`
/// {name: {on, why, bound}} as in --stats, `seconds` {read, rasterize, trace, resolve, march,
/// total}, `memory_bytes` {smoke, light, shadows, pixels, total, budget}, `notes`.
std::string planJson(const FramePlan& plan);

}  // namespace photosphere::scene
