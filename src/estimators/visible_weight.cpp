#include "visible_weight.h"

#include <algorithm>
#include <cmath>

#include "photosphere/core/sampling.h"
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
// Directions all round, and lines toward each.
constexpr int kRings = 4, kSectors = 4;
constexpr double kLinesAllRound = 2;
// Voxel edges from the eye within which lines are not parallel, points along each edge of such a
// voxel, optical depth of a step through it, and transmittance below which nothing is seen.
constexpr double kNearby = 2.0;
constexpr int kPoints = 4;
constexpr float kFineDepth = 0.5f;
constexpr float kUnseen = 1e-4f;
constexpr RandomKey kLinesKey{0x9e3779b9u, 0x7f4a7c15u};

}  // namespace

float VisibleWeight::wayOut(std::size_t voxel, const Vec3f& p, const Vec3f& d) const {
  const Vec3f half(static_cast<float>(0.5 * m_lattice.edge()));
  return transport::exitDistance(-half, half, p - m_lattice.center(voxel), d);
}

float VisibleWeight::wayToEye(const Vec3f& p, const Vec3f& d) const {
  if (!m_view || !m_view->hasEye) return kInfinity;
  return static_cast<float>(std::max(0.0, glm::dot(m_view->eye - Vec3d(p), Vec3d(d))));
}

float VisibleWeight::at(std::size_t voxel, const Vec3f& p, const Vec2f& u) const {
  const float sigma = m_medium.extinction(p);
  if (!(sigma > 0.0f)) return m_everywhere;
  const Vec3f d = m_view ? m_view->toEye(p) : sampleSphere(u);
  const float hidden = depth(p, d, std::min(wayOut(voxel, p, d) + beyond(), wayToEye(p, d)));
  if (hidden >= kOpaque) return m_everywhere;
  return m_everywhere + sigma * static_cast<float>(m_lattice.edge()) * std::exp(-hidden);
}

template <class Visit>
void VisibleWeight::walk(const Vec3f& p, const Vec3f& d, float length, float stepDepth,
                         const Visit& visit) const {
  const auto extinction = m_medium.alongRay(p, d, transport::Still{});
  const float steepness = m_medium.steepness();
  const float slope = m_medium.majorants().maximum() * steepness;
  const float longest = 0.5f * static_cast<float>(m_medium.voxelEdge());
  const float shortest = transport::kDistanceResolution * (length + glm::length(p));
  for (float t = 0.0f; t < length;) {
    const float here = transport::extinctionOnward(extinction, t, 1.0f / steepness);
    const float part =
        std::max(shortest, std::min(longest, transport::thinPart(here, slope, stepDepth)));
    const float h = std::min(part, length - t);
    if (!visit(t, h, h * extinction(t + 0.5f * h))) return;
    t += part;
  }
}

float VisibleWeight::depth(const Vec3f& p, const Vec3f& d, float length) const {
  float sum = 0.0f;
  walk(p, d, length, kStepDepth, [&](float, float, float part) {
    sum += part;
    return sum < kOpaque;
  });
  return sum;
}

float VisibleWeight::mean(std::size_t voxel) const {
  Rng rng = linesOf(voxel);
  if (!m_view) {
    float sum = 0.0f;
    for (int y = 0; y < kRings; ++y)
      for (int x = 0; x < kSectors; ++x) {
        const Vec2f u = (Vec2f(x, y) + rng.uniform2()) / Vec2f(kSectors, kRings);
        sum += meanFromAfar(voxel, sampleSphere(u), kLinesAllRound, rng).seen;
      }
    return m_everywhere + sum / static_cast<float>(kRings * kSectors);
  }
  const double edge = m_lattice.edge();
  const Vec3f center = m_lattice.center(voxel);
  const bool nearby = m_view->hasEye && glm::length(m_view->eye - Vec3d(center)) < kNearby * edge;
  const Mean mean =
      nearby ? meanNearby(voxel, rng) : meanFromAfar(voxel, m_view->toEye(center), kLines, rng);
  return mean.seen < kHidden * mean.open ? 0.0f : mean.seen;
}

Rng VisibleWeight::linesOf(std::size_t voxel) const {
  const Vec3i cell = m_lattice.voxel(voxel);
  return {kLinesKey, RandomStream::visibility,
          static_cast<std::uint64_t>(cell.x) | static_cast<std::uint64_t>(cell.y) << 21 |
              static_cast<std::uint64_t>(cell.z) << 42};
}

// The integral of sigma_t T over the voxel is that over the faces turned to the eye of T where a
// line leaves, less T where it entered.
VisibleWeight::Mean VisibleWeight::meanFromAfar(std::size_t voxel, const Vec3f& d, double lines,
                                                Rng& rng) const {
  const Vec3f center = m_lattice.center(voxel);
  const auto edge = static_cast<float>(m_lattice.edge());
  const Vec3f across = glm::abs(d);
  Mean mean;
  for (int axis = 0; axis < 3; ++axis) {
    const int rows =
        static_cast<int>(std::ceil(lines * std::sqrt(static_cast<double>(across[axis]))));
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
      mean.open += absorbed;
      const float hidden = depth(p, d, std::min(beyond(), wayToEye(p, d)));
      if (hidden < kOpaque) mean.seen += std::exp(-hidden) * absorbed;
    }
  }
  return mean;
}

// A line from the eye through a random point of the voxel has sigma_t T r^2, integrated over what
// it has of the voxel, for the r^2 of the same: the mean over points of their quotient is that of
// sigma_t T over the volume, and finds the little of thick smoke that an eye inside it sees.
VisibleWeight::Mean VisibleWeight::meanNearby(std::size_t voxel, Rng& rng) const {
  const Vec3f center = m_lattice.center(voxel);
  const auto edge = static_cast<float>(m_lattice.edge());
  Mean mean;
  for (int i = 0; i < kPoints * kPoints * kPoints; ++i) {
    const Vec3f cell(i % kPoints, i / kPoints % kPoints, i / (kPoints * kPoints));
    const Vec2f u = rng.uniform2();
    const Vec3f p =
        center + edge * ((cell + Vec3f(u, rng.uniform())) / static_cast<float>(kPoints) - 0.5f);
    const Vec3f d = m_view->toEye(p);
    const float away = wayToEye(p, d);
    const float forth = std::min(away, wayOut(voxel, p, d));
    const float nearest = away - forth;
    const float farthest = away + wayOut(voxel, p, -d);
    float seen = 0.0f, passed = 1.0f;
    walk(p + d * forth, -d, farthest - nearest, kFineDepth, [&](float t, float h, float part) {
      const float a = nearest + t, b = a + h;
      const float left = passed * std::exp(-part);
      seen += (passed - left) * (a * a + a * b + b * b) / 3.0f;
      passed = left;
      return passed > kUnseen;
    });
    const float whole = (farthest * farthest * farthest - nearest * nearest * nearest) / 3.0f;
    if (!(seen > 0.0f) || !(whole > 0.0f)) continue;
    const float part = edge * seen / whole / static_cast<float>(kPoints * kPoints * kPoints);
    mean.open += part;
    const float hidden = depth(p + d * forth, d, std::min(beyond(), nearest));
    if (hidden < kOpaque) mean.seen += std::exp(-hidden) * part;
  }
  return mean;
}

}  // namespace photosphere::estimators
