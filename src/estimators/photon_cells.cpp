// Photons within a fixed radius: columns in the order of a grid of cells, so that a ball is a few
// runs of consecutive photons, summed eight at a time.

#include <algorithm>
#include <cmath>

#include "cell_grid.h"
#include "deposit.h"
#include "photosphere/estimators/photon_set.h"

// Where the build may not assume AVX2, the machine is asked. Both paths round alike: the lanes are
// the same and no operation is fused (-ffp-contract=off).
#if defined(__x86_64__) && !defined(__AVX2__)
#define PHOTOSPHERE_ASK_FOR_AVX2 1
#endif

namespace photosphere::estimators {

namespace {

constexpr int kLanes = PhotonColumns::kLanes;
// Cells along a radius: finer cells fit the ball better, coarser ones make longer runs. One is best
// below a hundred photons a ball, three for thousands; this is within 15 % of both (2026-11-22).
constexpr double kCellsAlongRadius = 1.5;

// What the sum over one run reads.
struct Run {
  std::array<const float*, 3> position, direction, power;
  int count = 0;
  Vec3f center{0.0f};
  float inverseRadiusSquared = 0.0f;
  Vec3f wo{0.0f};
  Vec3f signedWo{0.0f};  // wo times the sign of g
  float absG = 0.0f;
  float oneMinusAbsGSquared = 1.0f;
  const sphere::ZonalTable* smoothed = nullptr;
};
using Sums = float[3][kLanes];
using SumRun = void (*)(const Run&, Sums&);

template <SpatialKernel kernel>
[[gnu::always_inline]] inline float weightAt(float relativeSquared) {
  if constexpr (kernel == SpatialKernel::epanechnikov)
    return glm::max(0.0f, 1.0f - relativeSquared);
  else if constexpr (kernel == SpatialKernel::box)
    return relativeSquared <= 1.0f ? 1.0f : 0.0f;
  else
    return kernelWeight(kernel, relativeSquared);
}

// Kernel weights of `count` photons, a multiple of the lanes.
template <SpatialKernel kernel>
[[gnu::always_inline]] inline void weigh(const Run& run, int first, int count, float* weights) {
  const float* __restrict px = run.position[0] + first;
  const float* __restrict py = run.position[1] + first;
  const float* __restrict pz = run.position[2] + first;
  const Vec3f center = run.center;
  const float inverse = run.inverseRadiusSquared;
  for (int i = 0; i < count; ++i) {
    const float x = px[i] - center.x, y = py[i] - center.y, z = pz[i] - center.z;
    weights[i] = weightAt<kernel>((x * x + y * y + z * z) * inverse);
  }
}

// Multiplies weights by the phase function: phase::HenyeyGreenstein without its constant factor,
// |wo - s wi| taken as |s wo - wi|.
template <bool smoothed>
[[gnu::always_inline]] inline void scatter(const Run& run, int first, int count, float* weights) {
  const float* __restrict dx = run.direction[0] + first;
  const float* __restrict dy = run.direction[1] + first;
  const float* __restrict dz = run.direction[2] + first;
  const Vec3f wo = run.signedWo;
  const float g = run.absG, narrow = run.oneMinusAbsGSquared;
  for (int i = 0; i < count; ++i) {
    if constexpr (smoothed) {
      if (weights[i] > 0.0f) weights[i] *= (*run.smoothed)({dx[i], dy[i], dz[i]}, run.wo);
    } else {
      const float x = wo.x - dx[i], y = wo.y - dy[i], z = wo.z - dz[i];
      const float inverse = 1.0f / std::sqrt(narrow + g * (x * x + y * y + z * z));
      weights[i] *= inverse * inverse * inverse;
    }
  }
}

// Adds power * kernel * phase of a run, photon i of a block in lane i. Plain loops over arrays
// without a carried sum, of which compilers make vector instructions; photons that a last block
// holds beyond the run weigh nothing.
template <SpatialKernel kernel, int channels, bool smoothed>
[[gnu::always_inline]] inline void sumLanes(const Run& run, Sums& sums) {
  constexpr int kChunk = 256;
  float weights[kChunk];
  for (int first = 0; first < run.count; first += kChunk) {
    const int count = std::min(kChunk, run.count - first);
    const int padded = (count + kLanes - 1) / kLanes * kLanes;
    weigh<kernel>(run, first, padded, weights);
    for (int i = count; i < padded; ++i)
      weights[i] = 0.0f;
    scatter<smoothed>(run, first, padded, weights);
    for (int c = 0; c < channels; ++c) {
      const float* __restrict power = run.power[static_cast<std::size_t>(c)] + first;
      float* __restrict lanes = sums[c];
      for (int i = 0; i < padded; i += kLanes)
        for (int l = 0; l < kLanes; ++l)
          lanes[l] += weights[i + l] * power[i + l];
    }
  }
}

template <SpatialKernel kernel, int channels, bool smoothed>
void sumPortable(const Run& run, Sums& sums) {
  sumLanes<kernel, channels, smoothed>(run, sums);
}

#ifdef PHOTOSPHERE_ASK_FOR_AVX2
template <SpatialKernel kernel, int channels, bool smoothed>
[[gnu::target("avx2")]] void sumAvx2(const Run& run, Sums& sums) {
  sumLanes<kernel, channels, smoothed>(run, sums);
}
#endif

template <SpatialKernel kernel, int channels, bool smoothed>
SumRun chooseWidth() {
#ifdef PHOTOSPHERE_ASK_FOR_AVX2
  if (__builtin_cpu_supports("avx2")) return sumAvx2<kernel, channels, smoothed>;
#endif
  return sumPortable<kernel, channels, smoothed>;
}

template <SpatialKernel kernel>
SumRun chooseSum(int channels, bool smoothed) {
  if (channels == 1)
    return smoothed ? chooseWidth<kernel, 1, true>() : chooseWidth<kernel, 1, false>();
  return smoothed ? chooseWidth<kernel, 3, true>() : chooseWidth<kernel, 3, false>();
}

SumRun chooseSum(SpatialKernel kernel, int channels, bool smoothed) {
  switch (kernel) {
    case SpatialKernel::epanechnikov:
      return chooseSum<SpatialKernel::epanechnikov>(channels, smoothed);
    case SpatialKernel::box:
      return chooseSum<SpatialKernel::box>(channels, smoothed);
    case SpatialKernel::gaussian:
      return chooseSum<SpatialKernel::gaussian>(channels, smoothed);
  }
  return nullptr;
}

float total(const float (&lanes)[kLanes]) {
  float sum = 0.0f;
  for (const float lane : lanes)
    sum += lane;
  return sum;
}

class FixedRadiusSet final : public PhotonSet {
 public:
  FixedRadiusSet(const PhotonColumns& photons, SpatialKernel kernel, double radius)
      : m_grid(photons.positions(), radius / kCellsAlongRadius),
        m_photons(photons.inOrder(m_grid.order())),
        m_radius(static_cast<float>(radius)),
        m_scale(static_cast<float>(1.0 / kernelVolume(kernel, radius))),
        m_sum(chooseSum(kernel, photons.channels, false)),
        m_sumSmoothed(chooseSum(kernel, photons.channels, true)) {
    m_grid.forgetOrder();
  }

  Rgb scattered(const Vec3f& p, const Vec3f& wo, const Lobe& lobe) const override {
    // Any other phase function comes as a table (Lobe).
    const double g = lobe.phase.plain() ? lobe.phase.plain()->g() : 0.0;
    Run run;
    run.center = p;
    run.inverseRadiusSquared = 1.0f / (m_radius * m_radius);
    run.wo = wo;
    run.signedWo = g < 0 ? -wo : wo;
    run.absG = static_cast<float>(std::abs(g));
    run.oneMinusAbsGSquared = static_cast<float>((1 - std::abs(g)) * (1 - std::abs(g)));
    run.smoothed = lobe.smoothed.get();
    const SumRun sum = run.smoothed ? m_sumSmoothed : m_sum;
    Sums sums = {};
    m_grid.forEachRun(p, m_radius, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::size_t a = 0; a < 3; ++a) {
        run.position[a] = m_photons.position[a].data() + begin;
        run.direction[a] = m_photons.direction[a].data() + begin;
        run.power[a] = m_photons.power[a].data() + begin;
      }
      run.count = static_cast<int>(end - begin);
      sum(run, sums);
    });
    const float scale =
        run.smoothed ? m_scale : m_scale * static_cast<float>((1 - g * g) / (4 * kPi));
    if (m_photons.channels == 1) return Rgb(scale * total(sums[0]));
    return scale * Rgb(total(sums[0]), total(sums[1]), total(sums[2]));
  }
  const PhotonColumns& photons() const override { return m_photons; }
  std::uint64_t memoryBytes() const override {
    return m_photons.memoryBytes() + m_grid.memoryBytes();
  }

 private:
  CellGrid m_grid;
  PhotonColumns m_photons;
  float m_radius, m_scale;
  SumRun m_sum, m_sumSmoothed;
};

}  // namespace

std::unique_ptr<PhotonSet> makeFixedRadiusSet(const PhotonColumns& photons, SpatialKernel kernel,
                                              double radius) {
  return std::make_unique<FixedRadiusSet>(photons, kernel, radius);
}

}  // namespace photosphere::estimators
