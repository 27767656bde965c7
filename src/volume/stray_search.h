#pragma once
// The search for strays among pieces of smoke, whatever they are made of.

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "photosphere/volume/strays.h"

namespace photosphere::volume {

/// A particle with its radius, or a block of voxels.
struct Lump {
  Box3d box;
  Vec3d at;           ///< where it counts as being: inside the box
  double weight = 0;  ///< finite, not negative
  std::uint64_t count = 1;
};

namespace strays {

inline constexpr double kMostShare = 0.005, kMostCount = 0.01;
/// Distance from the rest, in longest edges of its box.
inline constexpr double kReach = 64;

/// Weights along one axis of a box, and what lies below and above it.
class Profile {
 public:
  Profile(double low, double high)
      : m_low(low), m_high(high), m_scale(kBins / (high - low)), m_bins(kBins) {}
  void add(double at, double weight) {
    const double bin = (at - m_low) * m_scale;
    if (bin < 0)
      m_below += weight;
    else if (bin > kBins)
      m_above += weight;
    else
      m_bins[std::min(static_cast<std::size_t>(bin), kBins - 1)] += weight;
  }
  /// Bounds of what remains when no more than `most` is left out at either end, wider by a bin
  /// against rounding.
  std::pair<double, double> within(double most) const {
    std::size_t first = 0, last = kBins;
    for (double sum = m_below; first + 1 < kBins && (sum += m_bins[first]) <= most; ++first) {
    }
    for (double sum = m_above; last > first + 1 && (sum += m_bins[last - 1]) <= most; --last) {
    }
    const auto at = [&](std::size_t bin) { return m_low + static_cast<double>(bin) / m_scale; };
    return {first > 1 ? at(first - 1) : m_low, last + 1 < kBins ? at(last + 1) : m_high};
  }

 private:
  static constexpr std::size_t kBins = 1024;
  double m_low, m_high, m_scale;
  double m_below = 0, m_above = 0;
  std::vector<double> m_bins;
};

}  // namespace strays

/// @param lump  gives piece i of `count`; called several times for each
template <class LumpAt>
std::optional<Strays> searchStrays(std::size_t count, const LumpAt& lump) {
  Box3d middle;
  Strays found;
  double all = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Lump piece = lump(i);
    middle.grow(piece.at);
    all += piece.weight;
    found.all += piece.count;
  }
  if (!(all > 0) || !std::isfinite(all) || !std::isfinite(maxComponent(middle.extent())))
    return std::nullopt;
  const Box3d whole = middle;
  // Closes in on nearly all of the weight, some hundred times a round at most.
  for (bool closer = true; closer;) {
    const Box3d before = middle;
    closer = false;
    for (int axis = 0; axis < 3; ++axis) {
      const double edge = before.extent()[axis];
      if (!(edge > 0)) continue;
      strays::Profile profile(before.min[axis], before.max[axis]);
      for (std::size_t i = 0; i < count; ++i) {
        const Lump piece = lump(i);
        profile.add(piece.at[axis], piece.weight);
      }
      const auto [low, high] = profile.within(strays::kMostShare * all);
      middle.min[axis] = low;
      middle.max[axis] = high;
      closer = closer || (high - low < 0.5 * edge && high - low > 1e-12 * whole.extent()[axis]);
    }
  }
  Box3d rest;
  for (std::size_t i = 0; i < count; ++i)
    if (const Lump piece = lump(i); middle.contains(piece.at)) rest.grow(piece.box);
  if (rest.empty()) return std::nullopt;
  found.size = maxComponent(rest.extent());
  found.kept = {glm::max(rest.min - strays::kReach * found.size, glm::min(whole.min, rest.min)),
                glm::min(rest.max + strays::kReach * found.size, glm::max(whole.max, rest.max))};
  const Box3d near = found.kept;
  double outside = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Lump piece = lump(i);
    if (near.contains(piece.at)) {
      found.kept.grow(piece.box);
      continue;
    }
    outside += piece.weight;
    found.count += piece.count;
    found.farthest = std::max(found.farthest, glm::length(piece.at - rest.nearest(piece.at)));
  }
  found.share = outside / all;
  if (found.count == 0 || found.share > strays::kMostShare ||
      static_cast<double>(found.count) > strays::kMostCount * static_cast<double>(found.all))
    return std::nullopt;
  return found;
}

}  // namespace photosphere::volume
