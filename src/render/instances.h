#pragma once
// The four kinds of rays that are compiled apart: transmittances of one number or of each channel,
// smoke that holds still or moves.

#include "photosphere/transport/medium.h"

// Calls M(light, when) for each.
#define PHOTOSPHERE_FOR_EACH_RAY(M) \
  M(float, transport::Still)        \
  M(float, transport::Moment)       \
  M(Rgb, transport::Still)          \
  M(Rgb, transport::Moment)

namespace photosphere::render {

/// make(light, when) with the types that the medium needs.
template <class Make>
auto makeFor(const transport::Medium& medium, const Make& make) {
  if (medium.isMoving())
    return medium.isColoured() ? make(Rgb(), transport::Moment())
                               : make(float(), transport::Moment());
  return medium.isColoured() ? make(Rgb(), transport::Still()) : make(float(), transport::Still());
}

}  // namespace photosphere::render
