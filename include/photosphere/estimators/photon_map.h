#pragma once
// The volume photon map (Jensen & Christensen 1998; Min & Ihm 2010, section 3.2.2, eq. 4 and 6):
// the baseline that light fields are measured against.

#include <cstdint>
#include <memory>

#include "photosphere/core/types.h"
#include "photosphere/estimators/inscatter.h"
#include "photosphere/estimators/light_field.h"
#include "photosphere/sphere/smoothing.h"
#include "photosphere/transport/photon_tracer.h"

namespace photosphere::estimators {

/// How photons are stored and looked up.
struct PhotonMapLayout {
  double radius = 0.0;  ///< of the ball of a lookup [m]; with `neighbors` at most
  SpatialKernel kernel = SpatialKernel::epanechnikov;
  std::uint32_t neighbors = 0;  ///< nearest photons used at most, the ball ending at the next one;
                                ///< 0 = all within the radius
  int channels = 3;             ///< 1 where lights and media are grey
  bool unscattered =
      false;  ///< photons of lamps with extent are kept from their first collision, apart
  sphere::SmoothingKernel directionKernel;  ///< spreads each photon's direction (figure 11)
  int passes = 1;  ///< of a progressive map; each is a map of its own, of a smaller radius
};

/// Photons at their collisions. Their density is sigma_t times fluence, so the source they give is
/// sigma_s / sigma_t * sum of power * kernel * phase (METHOD.md section 3, erratum 2: eq. 4 and 9
/// multiply by sigma_s). Same bits for any number of threads.
class PhotonMap : public InscatterSource {
 public:
  /// Photons stored in all.
  virtual std::uint64_t photons() const = 0;
  virtual std::uint64_t memoryBytes() const = 0;
};

/// Traces photons and lays them out for lookups.
/// @throws MemoryError for more photons than 32 bits number; InterruptedError
std::unique_ptr<PhotonMap> tracePhotonMap(const transport::Medium& medium,
                                          const transport::LightList& lights,
                                          const PhotonMapLayout& layout,
                                          const transport::TraceOptions& options,
                                          transport::TraceStatistics& statistics);

/// What a map will be like, from tracing a few thousand of its photons.
struct PhotonForecast {
  std::uint64_t photons = 0;  ///< that a map of `options.photonCount` stores, within a few percent
  double volume = 0.0;  ///< that as many photons would fill at the density that the mean photon
                        ///< has about it [m^3]
};
PhotonForecast forecastPhotons(const transport::Medium& medium, const transport::LightList& lights,
                               bool unscattered, const transport::TraceOptions& options);

/// Bytes at the most, while it is built, of a map of that many photons.
std::uint64_t photonMapBytes(const PhotonMapLayout& layout, std::uint64_t photons);

/// The radius that `radius = 0` stands for [m]: wide enough that its ball holds a few tens of
/// photons where the mean photon is, between a quarter of a density voxel and eight.
double automaticRadius(const transport::Medium& medium, const PhotonForecast& forecast);

/// Radius of pass `pass` (from 0) of a progressive map over that of the first: the volume of the
/// ball shrinks by (i + a) / (i + 1) from pass i to the next, a = 2/3, so that the error of the
/// mean over passes vanishes (Knaus & Zwicker 2011, eq. 20 for volumes).
double progressiveRadiusFactor(int pass);

}  // namespace photosphere::estimators
