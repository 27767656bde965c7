#pragma once
// Lamps that stand in the smoke or near by, whose light grows as 1/d^2 toward them: a path that
// meets it only where it happens to collide finds little of it, seldom and all at once.

#include <optional>
#include <vector>

#include "photosphere/core/rng.h"
#include "photosphere/transport/medium.h"
#include "photosphere/transport/photon_tracer.h"

namespace photosphere::render {

/// Shares the light of each such lamp between two ways of finding it: where paths collide, and
/// where a point of the flight is drawn for the lamp. The shares add up to 1 at every place, so the
/// two sums have the mean of one. Immutable; thread-safe.
class NearLamps {
 public:
  NearLamps(const transport::Medium& medium, const std::vector<const lights::Light*>& lamps);

  struct Lamp {
    Vec3f center{0.0f};   ///< local space [m]
    float radius = 0.0f;  ///< of the ball in which points are drawn [m]; 0 = the lamp is not near

    /// Share of the light that is found by drawn points [0, 1]: 1 at the lamp, 0 from the ball's
    /// surface on.
    float share(float squaredDistance) const {
      if (!(radius > 0.0f)) return 0.0f;
      const float outside = glm::max(0.0f, 1.0f - squaredDistance / (radius * radius));
      return outside * outside;
    }
    /// Share of its light at `p` that is found where paths collide.
    float shareOfCollisions(const Vec3f& p) const {
      const Vec3f toLamp = center - p;
      return 1.0f - share(glm::dot(toLamp, toLamp));
    }
  };
  /// One for each of `lamps`.
  const std::vector<Lamp>& lamps() const { return m_lamps; }
  /// True when none of them is near.
  bool none() const { return m_none; }

  struct Drawn {
    float distance = 0.0f;  ///< along the ray [m]
    float weight = 0.0f;    ///< the lamp's share there over the density of drawing [m]
  };
  /// A point of a ray inside the lamp's ball, close to the lamp rather than far; none where the ray
  /// passes the ball by. In the spirit of equiangular sampling (Kulla and Fajardo 2012), with a
  /// density that needs no angles: 1 / (D + |s|)^2 at s from where the ray comes nearest, D there.
  /// @param length  of the ray [m]
  static std::optional<Drawn> draw(const Lamp& lamp, const Vec3f& o, const Vec3f& d, float length,
                                   float u);

 private:
  std::vector<Lamp> m_lamps;
  bool m_none = true;
};

}  // namespace photosphere::render
