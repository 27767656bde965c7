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
// Cells along a radius. Finer cells fit the ball better, coarser ones make longer runs; a cell
// should still hold a few photons.
constexpr double kCellsAlongRadius = 2.0;

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

// Adds power * kernel * phase of a run, lane by lane. The photons of a block are independent, so
// that compilers make vector instructions of the inner loops; those past the end weigh nothing.
template <SpatialKernel kernel, int channels, bool smoothed>
[[gnu::always_inline]] inline void sumLanes(const Run& run, Sums& sums) {
  float local[channels][kLanes];
  for (int c = 0; c < channels; ++c)
    for (int l = 0; l < kLanes; ++l)
      local[c][l] = sums[c][l];
  const float *px = run.position[0], *py = run.position[1], *pz = run.position[2];
  const float *dx = run.direction[0], *dy = run.direction[1], *dz = run.direction[2];
  const Vec3f center = run.center, signedWo = run.signedWo;
  const float inverseRadiusSquared = run.inverseRadiusSquared, absG = run.absG,
              oneMinusAbsGSquared = run.oneMinusAbsGSquared;
  for (int first = 0; first < run.count; first += kLanes) {
    float weight[kLanes];
    for (int l = 0; l < kLanes; ++l) {
      const int i = first + l;
      const float x = px[i] - center.x, y = py[i] - center.y, z = pz[i] - center.z;
      const float w = weightAt<kernel>((x * x + y * y + z * z) * inverseRadiusSquared);
      weight[l] = i < run.count ? w : 0.0f;
    }
    for (int l = 0; l < kLanes; ++l) {
      const int i = first + l;
      if constexpr (smoothed) {
        weight[l] *= (*run.smoothed)({dx[i], dy[i], dz[i]}, run.wo);
      } else {
        // phase::HenyeyGreenstein without its constant factor, |wo - s wi| as |s wo - wi|.
        const float x = signedWo.x - dx[i], y = signedWo.y - dy[i], z = signedWo.z - dz[i];
        const float inverse =
            1.0f / std::sqrt(oneMinusAbsGSquared + absG * (x * x + y * y + z * z));
        weight[l] *= inverse * inverse * inverse;
      }
    }
    for (int c = 0; c < channels; ++c)
      for (int l = 0; l < kLanes; ++l)
        local[c][l] += weight[l] * run.power[static_cast<std::size_t>(c)][first + l];
  }
  for (int c = 0; c < channels; ++c)
    for (int l = 0; l < kLanes; ++l)
      sums[c][l] = local[c][l];
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
    const double g = lobe.phase.g();
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
