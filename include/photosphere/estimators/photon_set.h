#pragma once
// Photons as columns, and what a ball of them scatters toward the eye.

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/estimators/light_field.h"
#include "photosphere/estimators/lobe.h"

namespace photosphere::estimators {

/// Photons in columns of floats, padded so that whole blocks of lanes can be read at any photon.
struct PhotonColumns {
  static constexpr int kLanes = 8;

  std::array<std::vector<float>, 3> position;   ///< local space [m]
  std::array<std::vector<float>, 3> direction;  ///< unit, along propagation
  std::array<std::vector<float>, 3> power;      ///< one column where light is grey, else three [W]
  int channels = 1;
  std::size_t count = 0;

  PhotonColumns() = default;
  PhotonColumns(std::size_t size, int channelCount);
  Vec3f positionOf(std::size_t i) const { return {position[0][i], position[1][i], position[2][i]}; }
  Vec3f directionOf(std::size_t i) const {
    return {direction[0][i], direction[1][i], direction[2][i]};
  }
  Rgb powerOf(std::size_t i) const {
    return channels == 1 ? Rgb(power[0][i]) : Rgb(power[0][i], power[1][i], power[2][i]);
  }
  /// The same photons in another order.
  PhotonColumns inOrder(const std::vector<std::uint32_t>& order) const;
  std::vector<Vec3f> positions() const;
  std::uint64_t memoryBytes() const;

  /// Bytes of one photon of that many channels.
  static std::uint64_t bytesOf(int channels) {
    return (6 + static_cast<std::uint64_t>(channels)) * sizeof(float);
  }
};

/// Photons laid out for one way of looking them up. Immutable; thread-safe.
class PhotonSet {
 public:
  virtual ~PhotonSet() = default;
  /// Power times phase per volume at a point: the sum of eq. 6 with a normalised kernel, its
  /// 3/4 pi r^3 read as the ball's 4/3 pi r^3 [W m^-3 sr^-1].
  virtual Rgb scattered(const Vec3f& p, const Vec3f& wo, const Lobe& lobe) const = 0;
  virtual const PhotonColumns& photons() const = 0;
  virtual std::uint64_t memoryBytes() const = 0;
};

/// Every photon within a fixed radius.
/// @param radius  [m], > 0
std::unique_ptr<PhotonSet> makeFixedRadiusSet(const PhotonColumns& photons, SpatialKernel kernel,
                                              double radius);

/// The nearest photons, inside a ball that ends at the first photon left out.
/// @param neighbors  photons within the ball at most, >= 1
/// @param radius     of the ball at most [m], > 0
std::unique_ptr<PhotonSet> makeNearestSet(const PhotonColumns& photons, SpatialKernel kernel,
                                          std::uint32_t neighbors, double radius);

/// Integral of kernelWeight() over a ball of that radius [m^3].
double kernelVolume(SpatialKernel kernel, double radius);

}  // namespace photosphere::estimators
