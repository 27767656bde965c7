#pragma once
// Means of one ray's radiance over many random walks.

#include <cmath>
#include <vector>

#include "photosphere/core/parallel.h"
#include "photosphere/render/integrator.h"
#include "support/support.h"

namespace photosphere::test {

struct Estimate {
  double mean = 0, error = 0;  // standard error of the mean
};

/// Mean of a layer over many independent paths of one ray.
template <class Pick>
Estimate estimate(const render::Integrator& integrator, const Vec3d& origin, const Vec3f& direction,
                  std::size_t count, const Pick& pick) {
  constexpr std::size_t kChunk = 4096;
  if (kSanitized) count /= 20;
  const std::size_t chunks = (count + kChunk - 1) / kChunk;
  std::vector<double> sums(chunks), squares(chunks);
  parallelFor(chunks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t chunk = begin; chunk < end; ++chunk) {
      render::IntegratorCounters counters;
      for (std::size_t i = 0; i < kChunk; ++i) {
        Rng rng(RandomKey::fromSeed(11, 0), RandomStream::camera, chunk * kChunk + i);
        const double v = pick(integrator.radiance(origin, direction, {}, rng, counters));
        sums[chunk] += v;
        squares[chunk] += v * v;
      }
    }
  });
  double sum = 0, square = 0;
  for (std::size_t i = 0; i < chunks; ++i) {
    sum += sums[i];
    square += squares[i];
  }
  const double n = static_cast<double>(chunks * kChunk);
  const double mean = sum / n;
  return {mean, std::sqrt(std::max(0.0, square / n - mean * mean) / n)};
}

}  // namespace photosphere::test
