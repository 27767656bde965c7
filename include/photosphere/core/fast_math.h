#pragma once
// Elementary functions with the same bits on every CPU. Photon tracing and deposits must not depend
// on which libm variant a machine selects at run time, so these use only +, -, *, / and bit moves,
// which IEEE 754 rounds identically everywhere (the build passes -ffp-contract=off).
// Coefficients: Cephes single-precision library (S. Moshier), public domain.

#include <bit>
#include <cmath>
#include <cstdint>

#include "photosphere/core/types.h"

namespace photosphere {

/// e^x, relative error below 2e-7; 0 below x = -87.3, infinity above 88.7.
inline float fastExp(float x) {
  if (!(x > -87.33f)) return x != x ? x : 0.0f;
  if (x > 88.72f) return kInfinity;
  const float shifted = x * 1.44269504088896341f + 12582912.0f;  // rounds to the nearest integer
  const float n = shifted - 12582912.0f;
  float r = x - n * 0.693359375f;
  r = r - n * -2.12194440e-4f;
  const float z = r * r;
  const float low = 1.6666665459e-1f * r + 5.0000001201e-1f;
  const float middle = 8.3334519073e-3f * r + 4.1665795894e-2f;
  const float high = 1.9875691500e-4f * r + 1.3981999507e-3f;
  const float p = (low + z * (middle + z * high)) * z + r + 1.0f;
  const int k = static_cast<int>(n);
  // Two factors keep 2^k representable at both ends of the range.
  const int half = k >> 1;
  const float a = std::bit_cast<float>(static_cast<std::uint32_t>(half + 127) << 23);
  const float b = std::bit_cast<float>(static_cast<std::uint32_t>(k - half + 127) << 23);
  return p * a * b;
}

/// Natural logarithm of a positive normal float, absolute error below 1e-7 (relative near 1).
/// Zero and denormals give about -87.3, negative values are not allowed.
inline float fastLog(float x) {
  const std::uint32_t bits =
      std::bit_cast<std::uint32_t>(x < 1.17549435e-38f ? 1.17549435e-38f : x);
  // Exponent and mantissa in [sqrt(1/2), sqrt(2)), without a branch on the mantissa.
  const std::int32_t e = static_cast<std::int32_t>(bits - 0x3f3504f3u) >> 23;
  const float m = std::bit_cast<float>(bits - (static_cast<std::uint32_t>(e) << 23)) - 1.0f;
  // The series in pairs (Estrin), so that its terms need not wait for one another.
  const float z = m * m;
  const float w = z * z;
  const float low =
      (-2.4999993993e-1f * m + 3.3333331174e-1f) + z * (-1.6668057665e-1f * m + 2.0000714765e-1f);
  const float high = (-1.2420140846e-1f * m + 1.4249322787e-1f) +
                     z * (-1.1514610310e-1f * m + 1.1676998740e-1f) + w * 7.0376836292e-2f;
  const float fe = static_cast<float>(e);
  float y = (low + w * high) * m * z;
  y = y + fe * -2.12194440e-4f;
  y = y - 0.5f * z;
  return m + y + fe * 0.693359375f;
}

/// Sine and cosine of a full turn times `turns`, for turns in [0, 1]; absolute error below 1e-6.
struct SinCos {
  float sin, cos;
};
inline SinCos fastSinCosTurns(float turns) {
  const float scaled = turns * 4.0f;
  const float shifted = scaled + 0.5f;  // not negative, so the cast below rounds to the nearest
  const int quadrant = static_cast<int>(shifted);
  const float r = (scaled - static_cast<float>(quadrant)) * 1.57079632679489662f;  // +-pi/4
  const float z = r * r;
  const float s = ((-1.9515295891e-4f * z + 8.3321608736e-3f) * z - 1.6666654611e-1f) * z * r + r;
  const float c =
      ((2.443315711809948e-5f * z - 1.388731625493765e-3f) * z + 4.166664568298827e-2f) * z * z -
      0.5f * z + 1.0f;
  // Quadrants swap the two and change signs: by bits, since no predictor could guess them.
  const auto q = static_cast<std::uint32_t>(quadrant);
  const auto sine = std::bit_cast<std::uint32_t>(s), cosine = std::bit_cast<std::uint32_t>(c);
  const std::uint32_t swap = (sine ^ cosine) & (0u - (q & 1u));
  return {std::bit_cast<float>((sine ^ swap) ^ ((q & 2u) << 30)),
          std::bit_cast<float>((cosine ^ swap) ^ (((q + 1u) & 2u) << 30))};
}

}  // namespace photosphere
