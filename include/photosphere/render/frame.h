#pragma once
// One frame: camera samples, pixel filter, tiles, layers.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "photosphere/cameras/camera.h"
#include "photosphere/lights/light.h"
#include "photosphere/render/integrator.h"

namespace photosphere::render {

enum class FilterKind { box, triangle, blackmanHarris };

/// Part of a frame to render, in pixels; `max` exclusive.
struct Crop {
  Vec2i min{0}, max{0};
};

struct FrameOptions {
  int samples = 4;                 ///< camera samples a pixel
  FilterKind filter = FilterKind::blackmanHarris;
  double filterWidth = 0.0;        ///< full width [pixels]; 0 = the filter's own
  Crop crop;
  RandomKey key;
  lights::LocalSpace space;        ///< camera rays are in world space
};

/// Layers of a frame over its crop, row by row from the top, RGB interleaved as Rgb.
struct FrameLayers {
  Crop crop;
  Vec2i resolution{0};
  std::vector<Rgb> beauty, single, multiple, emission, background, transmittance;
  std::vector<float> alpha;   ///< 1 - mean transmittance
  std::vector<float> depth;   ///< opacity-weighted distance along the camera's axis [scene units]; kNoDepth
                              ///< where nothing was met
  std::uint64_t nanSamples = 0, negativeSamples = 0;
  Vec2i firstBad{-1};         ///< pixel of the first NaN or negative sample
  IntegratorCounters counters;
  int width() const { return crop.max.x - crop.min.x; }
  int height() const { return crop.max.y - crop.min.y; }
};

/// `Z` of a pixel without smoke: far and finite.
inline constexpr float kNoDepth = 1e10f;

/// Renders the crop. Each pixel's samples are drawn from its filter, so pixels do not depend on tiles,
/// crop or threads. @throws InterruptedError
FrameLayers renderFrame(const cameras::Camera& camera, const Integrator& integrator,
                        const FrameOptions& options);

/// Offset from the pixel centre, drawn from the filter's density. @return [pixels]
Vec2d sampleFilter(FilterKind filter, double width, const Vec2d& u);

}  // namespace photosphere::render
