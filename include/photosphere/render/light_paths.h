#pragma once
// Paths from the lamps to the eye (light tracing): the same light as path tracing finds from the
// other end, quiet where paths from the eye hardly ever find a lamp.

#include <cstdint>
#include <vector>

#include "photosphere/render/frame.h"
#include "photosphere/transport/importance.h"
#include "photosphere/transport/kept_trace.h"

namespace photosphere::render {

struct LightPathOptions {
  std::uint64_t photons = 0;  ///< over all lights
  RandomKey key;
  const transport::PhotonGuide* guide = nullptr;  ///< steers photons; null = equal power
  FilterKind filter = FilterKind::blackmanHarris;
  double filterWidth = 0.0;  ///< full width [pixels]; 0 = the filter's own
  Crop crop;
  lights::LocalSpace space;  ///< the camera is in world space
  Lens lens;                 ///< of a perspective camera
  int maxScatter = 0;        ///< scatterings at most, that toward the eye too; 0 = no cap
  Checkpoint* checkpoint = nullptr;
  std::uint64_t part = 0;  ///< tells the traces of a frame apart in its checkpoint
};

struct LightPaths {
  /// Light scattered twice or more (once or more where the smoke gave it off), over the crop, row
  /// by row [W m^-2 sr^-1].
  std::vector<Rgb> multiple;
  std::uint64_t joined = 0;  ///< collisions that brought light to the crop
  std::uint64_t capped = 0;  ///< collisions of photons that have scattered maxScatter times
  double cappedShare = 0.0;  ///< power of these photons, summed, over that of a whole one [1]
  transport::TraceStatistics traced;
};

/// Every collision of a photon is joined to the eye: power times phase times ratio-tracked
/// transmittance, on the part of the picture where the camera sees that place (Dutre et al. 1993,
/// "Monte Carlo light tracing with direct computation of pixel intensities"; cameras::Projection),
/// through the pixel filter. Unbiased; its variance is not bounded where the eye is inside the
/// smoke. The same bits for any number of threads.
/// @param medium  that does not move
/// @throws InterruptedError; Error when a pixel leaves the range of its 64-bit sum
LightPaths traceLightPaths(const cameras::Camera& camera, const transport::Medium& medium,
                           const transport::LightList& lights, const LightPathOptions& options);

}  // namespace photosphere::render
