#pragma once
// Warps from the unit square to directions and discs. All use the reproducible functions of
// fast_math.h; each has a chi-squared test against its density.

#include "photosphere/core/fast_math.h"
#include "photosphere/core/types.h"

namespace photosphere {

/// Orthonormal basis whose z axis is a given unit vector (Duff et al. 2017, branchless).
struct Frame {
  Vec3f x, y, z;

  static Frame fromZ(const Vec3f& n) {
    const float s = std::copysign(1.0f, n.z);
    const float a = -1.0f / (s + n.z);
    const float b = n.x * n.y * a;
    return {{1.0f + s * n.x * n.x * a, s * b, -s * n.x}, {b, s + n.y * n.y * a, -n.y}, n};
  }
  Vec3f toWorld(const Vec3f& v) const { return x * v.x + y * v.y + z * v.z; }
};

/// Unit direction from the cosine to the z axis and a turn in [0, 1).
inline Vec3f directionFromCosine(float cosTheta, float turns) {
  const float sinTheta = std::sqrt(glm::max(0.0f, (1.0f - cosTheta) * (1.0f + cosTheta)));
  const SinCos phi = fastSinCosTurns(turns);
  return {sinTheta * phi.cos, sinTheta * phi.sin, cosTheta};
}

/// Uniform on the sphere, density 1 / (4 pi).
inline Vec3f sampleSphere(const Vec2f& u) {
  return directionFromCosine(1.0f - 2.0f * u.x, u.y);
}

/// Uniform in a cone about +z; density 1 / (2 pi (1 - cosMax)).
/// @param oneMinusCosMax  1 - cos(half-angle), which a narrow cone needs exact
inline Vec3f sampleCone(const Vec2f& u, float oneMinusCosMax) {
  const float h = u.x * oneMinusCosMax;  // 1 - cos(theta)
  const float sinTheta = std::sqrt(glm::max(0.0f, h * (2.0f - h)));
  const SinCos phi = fastSinCosTurns(u.y);
  return {sinTheta * phi.cos, sinTheta * phi.sin, 1.0f - h};
}

/// Cosine-weighted on the hemisphere about +z, density cos / pi.
inline Vec3f sampleCosineHemisphere(const Vec2f& u) {
  const float r = std::sqrt(u.x);
  const SinCos phi = fastSinCosTurns(u.y);
  return {r * phi.cos, r * phi.sin, std::sqrt(glm::max(0.0f, 1.0f - u.x))};
}

/// Uniform on the unit disc.
inline Vec2f sampleDisc(const Vec2f& u) {
  const float r = std::sqrt(u.x);
  const SinCos phi = fastSinCosTurns(u.y);
  return {r * phi.cos, r * phi.sin};
}

}  // namespace photosphere
