#pragma once
// What every estimator answers: how much light is scattered at a point toward the eye.

#include <vector>

#include "photosphere/transport/medium.h"

namespace photosphere::estimators {

/// In-scattered source [W m^-3 sr^-1], split as the layers are.
struct Inscatter {
  Rgb single{0.0f};    ///< light of lamps with extent (environment) scattered once
  Rgb multiple{0.0f};  ///< light scattered at least twice
};

/// Reading side of an estimator, fixed for one frame and one view. Thread-safe.
class InscatterSource {
 public:
  virtual ~InscatterSource() = default;
  /// @param p   local space [m]
  /// @param wo  unit propagation direction toward the eye
  /// @param c   the medium's coefficients at p
  virtual Inscatter at(const Vec3f& p, const Vec3f& wo, const transport::Coefficients& c) const = 0;
  /// True when the light of lamps with extent is in `Inscatter::single` and must not be sampled
  /// again.
  virtual bool carriesUnscattered() const = 0;
  /// Light that carriers show below zero, over what they show above: how much a basis rings that
  /// can. It is kept, so that sums are right; a ray's sum is no less than 0.
  virtual double negativeShare() const { return 0.0; }
};

/// The eye that looks at the smoke, local space.
struct View {
  bool hasEye = true;
  Vec3d eye{0.0};             ///< position [m], where hasEye
  Vec3f direction{0, 0, -1};  ///< unit view direction, used where there is no eye
  /// Planes (unit normal inward, offset) around all that will be looked at, local space [m]: light
  /// beyond them need not be stored. Empty = everywhere.
  std::vector<glm::dvec4> planes;

  /// Whether a ball may be looked at.
  bool sees(const Vec3d& center, double radius) const {
    for (const glm::dvec4& plane : planes)
      if (glm::dot(plane, glm::dvec4(center, 1.0)) < -radius) return false;
    return true;
  }

  /// Unit propagation direction from a point toward the eye.
  Vec3f toEye(const Vec3f& p) const {
    if (!hasEye) return -direction;
    const Vec3d d = eye - Vec3d(p);
    const double length = glm::length(d);
    return length > 0 ? Vec3f(d / length) : -direction;
  }
};

}  // namespace photosphere::estimators
