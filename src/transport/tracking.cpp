#include "photosphere/transport/tracking.h"

#include <type_traits>

namespace photosphere::transport {

Segment clipToMedium(const Medium& medium, const Vec3d& origin, const Vec3f& direction,
                     double maxDistance) {
  Segment segment;
  double t0 = 0.0, t1 = maxDistance;
  const Vec3d d(direction);
  if (!clip(medium.bounds(), origin, d, t0, t1)) return segment;
  segment.origin = Vec3f(origin + d * t0);
  segment.direction = direction;
  segment.length = static_cast<float>(t1 - t0);
  segment.begin = t0;
  return segment;
}

template <class Light, class When>
Light marchOpticalDepth(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                        float step, When when) {
  using Sum = std::conditional_t<std::is_same_v<Light, float>, double, Vec3d>;
  throwIfInterrupted();
  const auto extinction = medium.alongRay(o, d, when);
  Sum depth(0.0);
  for (volume::MajorantGrid::Walk walk(medium.majorants(), o, d, 0.0f, length); !walk.done();
       walk.advance()) {
    if (!(walk.majorant() > 0.0f)) continue;
    const float begin = walk.begin();
    const float span = walk.end() - begin;
    if (!(span > 0.0f)) continue;
    const float own = step * medium.majorants().coarseness(walk.cell());
    const int n = glm::max(1, static_cast<int>(std::ceil(span / own)));
    const float h = span / static_cast<float>(n);
    Light sum(0.0f);
    for (int i = 0; i < n; ++i) {
      const float t = begin + (static_cast<float>(i) + 0.5f) * h;
      sum += extinctionAs<Light>(medium, o + d * t, extinction(t), when);
    }
    depth += Sum(sum * h);
  }
  return Light(depth);
}

template float marchOpticalDepth(const Medium&, const Vec3f&, const Vec3f&, float, float, Still);
template float marchOpticalDepth(const Medium&, const Vec3f&, const Vec3f&, float, float, Moment);
template Rgb marchOpticalDepth(const Medium&, const Vec3f&, const Vec3f&, float, float, Still);
template Rgb marchOpticalDepth(const Medium&, const Vec3f&, const Vec3f&, float, float, Moment);

}  // namespace photosphere::transport
