#pragma once
// Four lanes in one register, by the vector extension that g++ and clang++ share: arithmetic acts
// lane by lane, in the order of the source, so results have the same bits on every machine.

#include <cstring>

namespace photosphere {

using Float4 = float __attribute__((vector_size(16)));

/// Four consecutive floats, aligned or not.
inline Float4 load(const float* p) {
  Float4 v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

/// Lane by lane.
inline Float4 max(Float4 a, Float4 b) {
  return a < b ? b : a;
}
inline Float4 min(Float4 a, Float4 b) {
  return b < a ? b : a;
}

/// a[0], a[1], b[0], b[1].
inline Float4 loadPairs(const float* a, const float* b) {
  using Double2 = double __attribute__((vector_size(16)));
  double x, y;
  std::memcpy(&x, a, sizeof x);
  std::memcpy(&y, b, sizeof y);
  return reinterpret_cast<Float4>(Double2{x, y});
}

}  // namespace photosphere
