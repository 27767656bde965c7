#pragma once
// Phase functions: the table of models and the evaluator that hot loops use.

#include <span>
#include <string_view>

#include "photosphere/core/param.h"
#include "photosphere/core/sampling.h"
#include "photosphere/core/types.h"

namespace photosphere::phase {

/// Henyey-Greenstein phase function [1/sr], normalised over the sphere; g = 0 is isotropic.
/// Both directions along propagation: forward scattering keeps the direction.
/// Evaluated as METHOD section 6 asks: (1-|g|)^2 + 2|g| (1 - s cos), which keeps the peak near |g|
/// = 1. Source: Henyey & Greenstein 1941, eq. 2. Thread-safe; same bits on every CPU.
class HenyeyGreenstein {
 public:
  /// @param g  mean cosine, -1 < g < 1. @throws ConfigError outside
  explicit HenyeyGreenstein(double g = 0.0);

  double g() const { return m_g; }

  /// @param wi, wo  unit propagation directions before and after.
  float evaluate(const Vec3f& wi, const Vec3f& wo) const {
    // 2 (1 - s cos) = |wo - s wi|^2: exact for nearly equal directions, where 1 - dot() has no
    // digits.
    const Vec3f d = wo - m_sign * wi;
    return evaluateSquared(glm::dot(d, d));
  }

  /// Direction after scattering, density evaluate(wi, wo). Unit to rounding: the error of `wi` does
  /// not grow along a path of many scatterings.
  Vec3f sample(const Vec3f& wi, const Vec2f& u) const {
    // Inverse of the cumulative distribution, solved for t = 1 - s cos(theta) and factored so that
    // no two nearly equal numbers are subtracted: t = 2 (1-|g|)^2 (1-u) (1+|g| u) / (1-|g| + 2|g|
    // u)^2.
    const float ratio = m_oneMinusAbsG / (m_oneMinusAbsG + 2.0f * m_absG * u.x);
    const float t = 2.0f * (ratio * ratio) * ((1.0f - u.x) * (1.0f + m_absG * u.x));
    const float sinTheta = std::sqrt(glm::max(0.0f, t * (2.0f - t)));
    const SinCos phi = fastSinCosTurns(u.y);
    const Frame frame = Frame::fromZ(wi);
    const Vec3f w = frame.toWorld({sinTheta * phi.cos, sinTheta * phi.sin, m_sign * (1.0f - t)});
    return w * (1.5f - 0.5f * glm::dot(w, w));  // one Newton step toward unit length
  }

  /// Largest value over all directions [1/sr]; no evaluate() exceeds it, to the last bit.
  float maximum() const { return evaluateSquared(0.0f); }

 private:
  /// @param distanceSquared  |wo - s wi|^2
  float evaluateSquared(float distanceSquared) const {
    const float inverse = 1.0f / std::sqrt(m_oneMinusAbsGSquared + m_absG * distanceSquared);
    return m_numerator * inverse * inverse * inverse;  // in this order finite for every g
  }

  double m_g = 0.0;
  float m_absG = 0.0f;
  float m_sign = 1.0f;                 // of g: the side of the peak
  float m_oneMinusAbsG = 1.0f;         // formed in double
  float m_oneMinusAbsGSquared = 1.0f;  // formed in double
  float m_numerator = 0.0f;            // (1 - g^2) / (4 pi), formed in double
};

/// One phase model of the table. This version's models are all Henyey-Greenstein lobes.
struct PhasePlugin {
  std::string_view name;
  std::string_view help;
  std::span<const Param> params;
  /// @throws ConfigError
  HenyeyGreenstein (*create)(const ParamValues& values);
};

/// Every phase function (generated).
std::span<const PhasePlugin* const> phaseFunctions();

}  // namespace photosphere::phase
