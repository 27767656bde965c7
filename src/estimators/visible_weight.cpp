#include "visible_weight.h"

#include <algorithm>
#include <cmath>

#include "photosphere/core/rng.h"
#include "photosphere/transport/tracking.h"

namespace photosphere::estimators {

namespace {

constexpr float kOpaque = 8.0f;     // optical depth that hides what is behind
constexpr float kStepDepth = 4.0f;  // of a step that begins in thin smoke
// Share of a voxel that the eye sees, below which nothing is kept for it: few photons with large
// weights would stand for light that adds next to nothing.
constexpr float kHidden = 0.02f;
// Lines toward the eye along each edge of a voxel's face that is turned to it.
constexpr double kLines = 4;
constexpr RandomKey kLinesKey{0x9e3779b9u, 0x7f4a7c15u};

}  // namespace

float VisibleWeight::wayOut(std::size_t voxel, const Vec3f& p, const Vec3f& d) const {
  const Vec3f half(static_cast<float>(0.5 * m_lattice.edge()));
  return transport::exitDistance(-half, half, p - m_lattice.center(voxel), d);
}

float VisibleWeight::at(std::size_t voxel, const Vec3f& p) const {
  const float sigma = m_medium.extinction(p);
  if (!(sigma > 0.0f)) return 0.0f;
  const Vec3f d = m_view.toEye(p);
  const float hidden = depth(p, d, wayOut(voxel, p, d) + beyond());
  if (hidden >= kOpaque) return 0.0f;
  return sigma * static_cast<float>(m_lattice.edge()) * std::exp(-hidden);
}

float VisibleWeight::depth(const Vec3f& p, const Vec3f& d, float length) const {
  const auto extinction = m_medium.alongRay(p, d, transport::Still{});
  const float steepness = m_medium.steepness();
  const float slope = m_medium.majorants().maximum() * steepness;
  const float longest = 0.5f * static_cast<float>(m_medium.voxelEdge());
  const float shortest = transport::kDistanceResolution * (length + glm::length(p));
  float sum = 0.0f;
  for (float t = 0.0f; t < length && sum < kOpaque;) {
    const float here = transport::extinctionOnward(extinction, t, 1.0f / steepness);
    const float part =
        std::max(shortest, std::min(longest, transport::thinPart(here, slope, kStepDepth)));
    const float h = std::min(part, length - t);
    sum += h * extinction(t + 0.5f * h);
    t += part;
  }
  return sum;
}

float VisibleWeight::mean(std::size_t voxel) const {
  const Vec3f center = m_lattice.center(voxel);
  const auto edge = static_cast<float>(m_lattice.edge());
  const Vec3f d = m_view.toEye(center);
  const Vec3f across = glm::abs(d);
  const Vec3i cell = m_lattice.voxel(voxel);
  Rng rng(kLinesKey, RandomStream::visibility,
          static_cast<std::uint64_t>(cell.x) | static_cast<std::uint64_t>(cell.y) << 21 |
              static_cast<std::uint64_t>(cell.z) << 42);
  float sum = 0.0f, open = 0.0f;
  // The integral of sigma_t T over the voxel is that over the faces turned to the eye of T where a
  // line leaves, less T where it entered.
  for (int axis = 0; axis < 3; ++axis) {
    const int rows =
        static_cast<int>(std::ceil(kLines * std::sqrt(static_cast<double>(across[axis]))));
    const float share = across[axis] / static_cast<float>(rows * rows);
    for (int i = 0; i < rows * rows; ++i) {
      const Vec2f u = (Vec2f(i % rows, i / rows) + rng.uniform2()) / static_cast<float>(rows);
      Vec3f face;
      face[axis] = d[axis] > 0.0f ? 0.5f : -0.5f;
      face[(axis + 1) % 3] = u.x - 0.5f;
      face[(axis + 2) % 3] = u.y - 0.5f;
      const Vec3f p = center + edge * face;
      const float in = wayOut(voxel, p, -d);
      const float absorbed = share * -std::expm1(-depth(p - d * in, d, in));
      if (!(absorbed > 0.0f)) continue;
      open += absorbed;
      const float hidden = depth(p, d, beyond());
      if (hidden < kOpaque) sum += std::exp(-hidden) * absorbed;
    }
  }
  return sum < kHidden * open ? 0.0f : sum;
}

}  // namespace photosphere::estimators
