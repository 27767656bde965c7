#pragma once
// Phase functions: the table of models and the evaluator that hot loops use.

#include <span>
#include <string_view>
#include <vector>

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
    return evaluateSquared(distanceSquared(wi, wo));
  }

  /// Direction after scattering, density evaluate(wi, wo). Unit to rounding: the error of `wi` does
  /// not grow along a path of many scatterings.
  Vec3f sample(const Vec3f& wi, const Vec2f& u) const {
    // Inverse of the cumulative distribution, solved for t = 1 - s cos(theta) and factored so that
    // no two nearly equal numbers are subtracted: t = 2 (1-|g|)^2 (1-u) (1+|g| u) / (1-|g| + 2|g|
    // u)^2.
    const float ratio = m_oneMinusAbsG / (m_oneMinusAbsG + 2.0f * m_absG * u.x);
    return around(wi, 2.0f * (ratio * ratio) * ((1.0f - u.x) * (1.0f + m_absG * u.x)), u.y);
  }

  /// Largest value over all directions [1/sr]; no evaluate() exceeds it, to the last bit.
  float maximum() const { return evaluateSquared(0.0f); }

  /// |wo - s wi|^2 = 2 (1 - s cos), s the sign of g: exact for nearly equal directions, where
  /// 1 - dot() has no digits.
  float distanceSquared(const Vec3f& wi, const Vec3f& wo) const {
    const Vec3f d = wo - m_sign * wi;
    return glm::dot(d, d);
  }
  /// The unit direction with 1 - s cos(theta) = t, a part `turn` of a turn around `wi`.
  Vec3f around(const Vec3f& wi, float t, float turn) const {
    const float sinTheta = std::sqrt(glm::max(0.0f, t * (2.0f - t)));
    const SinCos phi = fastSinCosTurns(turn);
    const Frame frame = Frame::fromZ(wi);
    const Vec3f w = frame.toWorld({sinTheta * phi.cos, sinTheta * phi.sin, m_sign * (1.0f - t)});
    return w * (1.5f - 0.5f * glm::dot(w, w));  // one Newton step toward unit length
  }
  /// @param distanceSquared  |wo - s wi|^2
  float evaluateSquared(float distanceSquared) const {
    const float inverse = 1.0f / std::sqrt(m_oneMinusAbsGSquared + m_absG * distanceSquared);
    return m_numerator * inverse * inverse * inverse;  // in this order finite for every g
  }

 private:
  double m_g = 0.0;
  float m_absG = 0.0f;
  float m_sign = 1.0f;                 // of g: the side of the peak
  float m_oneMinusAbsG = 1.0f;         // formed in double
  float m_oneMinusAbsGSquared = 1.0f;  // formed in double
  float m_numerator = 0.0f;            // (1 - g^2) / (4 pi), formed in double
};

/// Henyey-Greenstein's function times 1 + alpha cos^2, normalised: Draine 2003 (ApJ 598, 1017).
/// alpha = 0 is Henyey-Greenstein's, g = 0 with alpha = 1 Rayleigh's. Thread-safe; same bits on
/// every CPU.
class Draine {
 public:
  /// A g nearer to 0 than 1e-3 counts as 0 where alpha is not 0.
  /// @throws ConfigError unless -1 < g < 1 and alpha >= 0 is finite
  explicit Draine(double g = 0.0, double alpha = 0.0);

  double g() const { return m_lobe.g(); }
  double alpha() const { return m_alpha; }
  /// Mean cosine: g (1 + alpha (3 + 2 g^2) / 5) / (1 + alpha (1 + 2 g^2) / 3).
  double meanCosine() const;

  float evaluate(const Vec3f& wi, const Vec3f& wo) const {
    return evaluateSquared(m_lobe.distanceSquared(wi, wo));
  }
  /// Density evaluate(wi, wo). Inverts the cumulative distribution by Newton's method, in double
  /// and without functions that differ between machines.
  Vec3f sample(const Vec3f& wi, const Vec2f& u) const;
  /// Largest value over all directions [1/sr]: straight on.
  float maximum() const { return evaluateSquared(0.0f); }

 private:
  float evaluateSquared(float distanceSquared) const {
    const float cosine = glm::max(-1.0f, 1.0f - 0.5f * distanceSquared);
    return m_lobe.evaluateSquared(distanceSquared) * m_norm * (1.0f + m_alphaF * (cosine * cosine));
  }

  HenyeyGreenstein m_lobe;
  double m_alpha = 0.0;
  float m_alphaF = 0.0f;
  float m_norm = 1.0f;  // 1 / (1 + alpha (1 + 2 g^2) / 3)
};

/// What a volume scatters by: one lobe, or a mixture of two. Thread-safe; same bits on every CPU.
class PhaseFunction {
 public:
  // Lobes are phase functions.
  PhaseFunction(const HenyeyGreenstein& lobe = HenyeyGreenstein())
      : m_plain(lobe), m_first(lobe.g()) {}
  PhaseFunction(const Draine& lobe) : PhaseFunction(lobe, Draine(), 0.0) {}
  /// @param weight  of the second lobe, in [0, 1]. @throws ConfigError outside
  PhaseFunction(const Draine& first, const Draine& second, double weight);

  float evaluate(const Vec3f& wi, const Vec3f& wo) const {
    return m_isPlain ? m_plain.evaluate(wi, wo) : evaluateMixture(wi, wo);
  }
  Vec3f sample(const Vec3f& wi, const Vec2f& u) const {
    return m_isPlain ? m_plain.sample(wi, u) : sampleMixture(wi, u);
  }
  /// No evaluate() exceeds it, to the last bit [1/sr].
  float maximum() const;
  double meanCosine() const;

  /// One Henyey-Greenstein lobe; nullptr for anything else.
  const HenyeyGreenstein* plain() const { return m_isPlain ? &m_plain : nullptr; }
  /// The lobes that carry weight, 1 or 2, and their weights, which add up to 1.
  int lobes() const { return m_weight > 0.0 ? 2 : 1; }
  const Draine& lobe(int i) const { return i == 0 ? m_first : m_second; }
  double weight(int i) const { return i == 0 ? 1.0 - m_weight : m_weight; }

  bool operator==(const PhaseFunction& other) const;

 private:
  float evaluateMixture(const Vec3f& wi, const Vec3f& wo) const;
  Vec3f sampleMixture(const Vec3f& wi, const Vec2f& u) const;

  HenyeyGreenstein m_plain;
  bool m_isPlain = true;
  Draine m_first, m_second;
  double m_weight = 0.0;  // of the second
};

/// Legendre moments, the integrals over the sphere of the phase function times P_l(cos), from
/// degree 0, which is 1, to the last that is not nothing (1e-7). Those of Henyey-Greenstein's
/// function are g^l. Lobes narrower than about 1e-3 rad are widened to that.
std::vector<double> legendreMoments(const PhaseFunction& phase);

/// One phase model of the table.
struct PhasePlugin {
  std::string_view name;
  std::string_view help;
  std::span<const Param> params;
  /// @throws ConfigError
  PhaseFunction (*create)(const ParamValues& values);
};

/// Every phase function (generated).
std::span<const PhasePlugin* const> phaseFunctions();

}  // namespace photosphere::phase
