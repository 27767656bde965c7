#pragma once
// Phase functions: the table of models and the evaluator that hot loops use.

#include <span>
#include <string_view>

#include "photosphere/core/param.h"
#include "photosphere/core/types.h"

namespace photosphere::phase {

/// Henyey-Greenstein phase function [1/sr], normalised over the sphere; g = 0 is isotropic.
/// Both directions along propagation: forward scattering keeps the direction.
/// Evaluated as METHOD section 6 asks: (1-|g|)^2 + 2|g| (1 - s cos), which keeps the peak near |g|
/// = 1.
class HenyeyGreenstein {
 public:
  /// @param g  mean cosine, -1 < g < 1. @throws ConfigError outside
  explicit HenyeyGreenstein(double g = 0.0);

  double g() const { return m_g; }
  /// @param wi, wo  unit propagation directions before and after. Thread-safe.
  float evaluate(const Vec3f& wi, const Vec3f& wo) const;
  /// Direction after scattering, density evaluate(wi, wo).
  Vec3f sample(const Vec3f& wi, const Vec2f& u) const;
  /// Largest value over all directions [1/sr].
  float maximum() const;

 private:
  double m_g = 0.0;
  float m_absG = 0.0f;
  float m_sign = 1.0f;
  float m_oneMinusAbsG = 1.0f;  // formed in double
  float m_numerator = 0.0f;     // (1 - g^2) / (4 pi), formed in double
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
