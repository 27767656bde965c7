#include "photosphere/estimators/photon_set.h"

#include <cmath>

#include "photosphere/core/parallel.h"

namespace photosphere::estimators {

PhotonColumns::PhotonColumns(std::size_t size, int channelCount)
    : channels(channelCount), count(size) {
  const std::size_t padded = size + static_cast<std::size_t>(kLanes);
  for (std::size_t a = 0; a < 3; ++a) {
    position[a].assign(padded, 0.0f);
    direction[a].assign(padded, 0.0f);
    if (static_cast<int>(a) < channels) power[a].assign(padded, 0.0f);
  }
}

PhotonColumns PhotonColumns::inOrder(const std::vector<std::uint32_t>& order) const {
  PhotonColumns out(count, channels);
  const auto reorder = [&](const std::vector<float>& from, std::vector<float>& to) {
    parallelFor(count, 1 << 15, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        to[i] = from[order[i]];
    });
  };
  for (std::size_t a = 0; a < 3; ++a) {
    reorder(position[a], out.position[a]);
    reorder(direction[a], out.direction[a]);
    if (static_cast<int>(a) < channels) reorder(power[a], out.power[a]);
  }
  return out;
}

std::vector<Vec3f> PhotonColumns::positions() const {
  std::vector<Vec3f> out(count);
  for (std::size_t i = 0; i < count; ++i)
    out[i] = positionOf(i);
  return out;
}

std::uint64_t PhotonColumns::memoryBytes() const {
  return (count + static_cast<std::uint64_t>(kLanes)) * bytesOf(channels);
}

double kernelVolume(SpatialKernel kernel, double radius) {
  const double cube = radius * radius * radius;
  switch (kernel) {
    case SpatialKernel::epanechnikov:
      return 8.0 / 15.0 * kPi * cube;
    case SpatialKernel::box:
      return 4.0 / 3.0 * kPi * cube;
    case SpatialKernel::gaussian: {
      // 4 pi times the integral of t^2 exp(-4.5 t^2) from 0 to 1.
      constexpr double a = 4.5;
      const double root = std::sqrt(a);
      return kPi * cube * (std::sqrt(kPi) * std::erf(root) / (a * root) - 2.0 * std::exp(-a) / a);
    }
  }
  return 0.0;
}

}  // namespace photosphere::estimators
