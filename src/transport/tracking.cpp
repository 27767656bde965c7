#include "photosphere/transport/tracking.h"

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

float marchOpticalDepth(const Medium& medium, const Vec3f& o, const Vec3f& d, float length,
                        float step) {
  const Medium::AlongRay extinction(medium, o, d);
  double depth = 0.0;
  for (volume::MajorantGrid::Walk walk(medium.majorants(), o, d, 0.0f, length); !walk.done();
       walk.advance()) {
    if (!(walk.majorant() > 0.0f)) continue;
    const float begin = walk.begin();
    const float span = walk.end() - begin;
    if (!(span > 0.0f)) continue;
    const int n = glm::max(1, static_cast<int>(std::ceil(span / step)));
    const float h = span / static_cast<float>(n);
    float sum = 0.0f;
    for (int i = 0; i < n; ++i)
      sum += extinction(begin + (static_cast<float>(i) + 0.5f) * h);
    depth += static_cast<double>(sum * h);
  }
  return static_cast<float>(depth);
}

}  // namespace photosphere::transport
