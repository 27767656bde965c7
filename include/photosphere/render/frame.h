#pragma once
// One frame: camera samples, pixel filter, tiles, layers.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "photosphere/cameras/camera.h"
#include "photosphere/cameras/moving_camera.h"
#include "photosphere/core/checkpoint.h"
#include "photosphere/lights/light.h"
#include "photosphere/render/integrator.h"

namespace photosphere::render {

enum class FilterKind { box, triangle, blackmanHarris };

/// Part of a frame to render, in pixels; `max` exclusive.
struct Crop {
  Vec2i min{0}, max{0};
};

/// A thin lens. @see cameras::Camera::ray for the rays through its middle
struct Lens {
  double radius = 0.0;         ///< [scene units]; 0 = a pinhole
  double focusDistance = 1.0;  ///< of the plane in focus, along the camera's axis [scene units]
};

struct FrameOptions {
  int samples = 4;      ///< camera samples a pixel
  int firstSample = 0;  ///< of the pixel's sequence of samples: passes of a frame continue it
  FilterKind filter = FilterKind::blackmanHarris;
  double filterWidth = 0.0;  ///< full width [pixels]; 0 = the filter's own
  Crop crop;
  RandomKey key;
  lights::LocalSpace space;  ///< camera rays are in world space
  Lens lens;                 ///< of a perspective camera
  bool moving = false;       ///< something moves while the shutter is open
  transport::Shutter shutter;
  const cameras::MovingCamera* motion = nullptr;  ///< the camera over the shutter, where it moves
  /// What an earlier run of the same frame had done, as `pause` was told; nullptr = nothing.
  StateReader* begun = nullptr;
  /// Called between bands of rows, and before an interruption: what the bands so far have made.
  PausePoint pause;
};

/// Layers of a frame over its crop, row by row from the top, RGB interleaved as Rgb.
struct FrameLayers {
  Crop crop;
  Vec2i resolution{0};
  std::vector<Rgb> beauty, single, multiple, emission, background, transmittance;
  std::vector<float> alpha;  ///< 1 - mean transmittance
  std::vector<float> depth;  ///< opacity-weighted distance along the camera's axis [scene units];
                             ///< kNoDepth where nothing was met
  std::uint64_t nanSamples = 0, negativeSamples = 0;
  Vec2i firstBad{-1};  ///< pixel of the first NaN or negative sample
  IntegratorCounters counters;
  int width() const { return crop.max.x - crop.min.x; }
  int height() const { return crop.max.y - crop.min.y; }
};

/// Puts another layer of multiple scattering into a frame and its beauty.
void setMultiple(FrameLayers& layers, std::vector<Rgb> multiple);

/// `Z` of a pixel without smoke: far and finite.
inline constexpr float kNoDepth = 1e10f;

/// Renders the crop. A sample counts in every pixel whose filter reaches it, so that few samples a
/// pixel integrate smooth smoke closely; samples beyond the crop's and the frame's border are
/// traced too, so pixels depend neither on the crop nor on threads. @throws InterruptedError
FrameLayers renderFrame(const cameras::Camera& camera, const Integrator& integrator,
                        const FrameOptions& options);

/// Mean of equal frames, each from passes of their own.
class FrameMean {
 public:
  void add(const FrameLayers& frame);
  /// Frames added so far.
  int count() const { return m_count; }
  /// The mean; counts of bad samples and of the integrator are sums. Empty before the first frame.
  FrameLayers mean() const;
  void keep(StateWriter& w) const;
  void resume(StateReader& r);

 private:
  FrameLayers m_sum;  // from two frames on, depth holds the sum of alpha times depth
  int m_count = 0;
};

/// Pixel filter as a function of the offset from the pixel centre, not normalised.
class PixelFilter {
 public:
  /// @param width  full width [pixels]; 0 = box 1, triangle 2, Blackman-Harris 3
  PixelFilter(FilterKind kind, double width);
  double radius() const { return m_radius; }
  float weight(const Vec2d& offset) const { return profile(offset.x) * profile(offset.y); }

 private:
  float profile(double x) const;
  FilterKind m_kind;
  double m_radius;
};

}  // namespace photosphere::render
