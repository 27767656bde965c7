#pragma once
// Points that fill a cube more evenly than random ones, the same on every CPU.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "photosphere/core/types.h"

namespace photosphere {

/// Point n of the R4 sequence (Roberts 2018, "The unreasonable effectiveness of quasirandom
/// sequences"): four numbers in [0, 1), evenly spread, that stay below 1 as floats.
inline Vec4f evenPoint(std::uint64_t n) {
  // Powers of the inverse of the root of x^5 = x + 1.
  constexpr double alphas[] = {0.8566748838545029, 0.733891856627126, 0.6287067210378087,
                               0.5385972572236101};
  Vec4f point;
  for (int i = 0; i < 4; ++i) {
    const double u = 0.5 + alphas[i] * static_cast<double>(n);
    point[i] = static_cast<float>(std::min(u - std::floor(u), 1.0 - 0x1p-24));
  }
  return point;
}

}  // namespace photosphere
