#pragma once
// What rays that leave the scene meet.

#include <vector>

#include "photosphere/transport/photon_tracer.h"

namespace photosphere::render {

/// The lights that such a ray may see. Of ten thousand lamps at points none is asked in vain for
/// each ray.
inline std::vector<const lights::Light*> backgroundsOf(const transport::Medium& medium,
                                                       const transport::LightList& lights) {
  const lights::BoundingSphere bounds = transport::boundingSphere(medium);
  std::vector<const lights::Light*> out;
  for (const auto& light : lights)
    if (light->reach(bounds).background > 0.0) out.push_back(light.get());
  return out;
}

}  // namespace photosphere::render
