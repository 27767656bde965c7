#pragma once
// Smoothing over directions (Min & Ihm 2010, section 4.2.2, eq. 8, as errata 4 of METHOD.md section
// 3 corrects it).

#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/sphere/partition.h"

namespace photosphere::sphere {

enum class AngularKernel { none, epanechnikov, gaussian };

/// Angle between two unit directions [rad], absolute error below 1e-6 and relative below 1e-6 near
/// zero. From the chord, which keeps its digits where the cosine has none; same bits on every CPU.
float angleBetween(const Vec3f& a, const Vec3f& b);

/// K_h: a density over the sphere [1/sr] that depends on the angle t to its centre alone.
/// Epanechnikov: proportional to 1 - (t/h)^2 within h; gaussian: to exp(-t^2 / (2 h^2)).
/// Its integral over the sphere is 1 for every bandwidth and truncation: eq. 8 divides by the h^2
/// of the plane, which is right for narrow kernels alone, and leaves a truncated kernel short of 1.
/// Same bits on every CPU, so that deposits may use it; immutable, thread-safe.
class SmoothingKernel {
 public:
  /// The kernel `none`: everything stays at its own direction. It has no value anywhere.
  SmoothingKernel() = default;
  /// @param bandwidth   h [rad] > 0
  /// @param truncation  > 0: zero beyond this many bandwidths, and beyond the antipode
  /// @throws ConfigError
  SmoothingKernel(AngularKernel kind, double bandwidth, double truncation);

  AngularKernel kind() const { return m_kind; }
  bool acts() const { return m_kind != AngularKernel::none; }
  /// Largest angle at which the kernel is not zero [rad], at most pi.
  float support() const { return m_support; }
  /// [1/sr]; not for `none`.
  float atAngle(float angle) const { return angle <= m_support ? m_scale * shape(angle) : 0.0f; }
  /// [1/sr] between two unit directions; not for `none`.
  float operator()(const Vec3f& a, const Vec3f& b) const { return atAngle(angleBetween(a, b)); }

 private:
  float shape(float angle) const;

  AngularKernel m_kind = AngularKernel::none;
  float m_support = 0;
  float m_inverseBandwidth = 1;
  float m_scale = 1;  // makes the integral over the sphere 1
};

/// Share of each bin's light that is restored in each cell, [cell][bin]: eq. 8 with
/// D_k = sum_j n_j * beta K_h(w_k, w_j), normalised per source bin so that every column sums to 1
/// (errata 4): no kernel, however wide, narrow or truncated, gains or loses energy. A kernel that
/// reaches no cell's centre leaves the light in the cell around its own. With `none` a bin's light
/// is spread evenly over the bin: over the cells that it overlaps.
/// @param bins   where light was stored
/// @param cells  where it is restored: the K directions of eq. 9, or `bins` again
std::vector<double> smoothingMatrix(const Partition& bins, const Partition& cells,
                                    const SmoothingKernel& kernel);

}  // namespace photosphere::sphere
