#pragma once
// Functions of the angle between two directions, and their convolution over the sphere.

#include <vector>

#include "photosphere/core/types.h"
#include "photosphere/sphere/smoothing.h"

namespace photosphere::sphere {

/// Legendre moments f_l = integral over the sphere of f P_l(cos). On the sphere they multiply where
/// functions of the angle are convolved, so f_0 = 1 stays 1: energy is kept, and an isotropic
/// function stays the same whatever it is convolved with.
using LegendreMoments = std::vector<double>;

/// Moments of a kernel, `count` of them; all 1 for `none`.
LegendreMoments kernelMoments(const SmoothingKernel& kernel, std::size_t count);
/// Moments of the convolution of two functions.
LegendreMoments convolved(const LegendreMoments& a, const LegendreMoments& b);
/// Moments of degree 0 to `order` of a function that is none below zero, spread by diffusion over
/// the sphere, f_l exp(-t l (l + 1)), for the least time t at which what is left of it dips below
/// zero by no more than `dip` of its mean: cut where a narrow lobe still has much above the order,
/// a series rings from pole to pole.
/// @param dip  0 or more
LegendreMoments cutAt(const LegendreMoments& moments, int order, double dip);

/// A function of the angle between two unit directions as a table, from its moments; never
/// negative. Immutable; thread-safe.
class ZonalTable {
 public:
  explicit ZonalTable(const LegendreMoments& moments);
  /// [1/sr]
  float operator()(const Vec3f& a, const Vec3f& b) const { return atAngle(angleBetween(a, b)); }
  /// [1/sr], angle in [0, pi]
  float atAngle(float angle) const {
    const float x = angle * m_scale;
    const auto i = static_cast<std::size_t>(x);
    const float f = x - static_cast<float>(i);
    return m_values[i] + (m_values[i + 1] - m_values[i]) * f;
  }
  /// Mean cosine of the angle.
  double meanCosine() const { return m_meanCosine; }

 private:
  std::vector<float> m_values;  // at even angles from 0 to pi, and the last again
  float m_scale = 1;
  double m_meanCosine = 0;
};

/// What light that is spread about a direction scatters: the phase function convolved with lobes of
/// every width. A lobe of mean cosine R is taken as Henyey-Greenstein's, whose moments are R^l: the
/// phase function itself for R = 1 (light in one direction), even for R = 0. Immutable;
/// thread-safe.
class LobeTable {
 public:
  explicit LobeTable(const LegendreMoments& phase);
  /// [1/sr] toward `wo` of light about the unit direction `mean`.
  /// @param concentration  R, the length of the mean of unit directions, in [0, 1]
  float operator()(float concentration, const Vec3f& mean, const Vec3f& wo) const;

 private:
  double m_g = 0.0;  // spaces the tables: by equal factors of 1 - g R
  float m_rows = 1.0f;
  float m_inverseLog = 1.0f;
  std::vector<ZonalTable> m_tables;
};

}  // namespace photosphere::sphere
