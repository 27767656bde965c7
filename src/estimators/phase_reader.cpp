#include "phase_reader.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "photosphere/core/simd.h"

namespace photosphere::estimators {

namespace {

// The least value of a phase function over its mean. Cut at an order it may dip that far below
// zero: the narrower a lobe, the darker it is beside it, and the more a dip there would take away.
// Error of light scattered more than once in the column, order 8 and 4, against no more than 0.1,
// 0.05, 0.02: g = 0.7 (0.10) 0.060, 0.060, 0.058 and 0.059, 0.060, 0.061; g = 0.85 (0.044) 0.110,
// 0.108, 0.109 and 0.19, 0.20, 0.22; g = 0.95 (0.013) 0.30, 0.27, 0.26 and 0.68, 0.73, 0.86, where
// uncut it is 3.0 and 5.0.
double leastShare(const phase::PhaseFunction& function) {
  constexpr int kAngles = 90;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kAngles; ++i) {
    const double angle = kPi * i / kAngles;
    const Vec3f w(Vec3d(std::sin(angle), 0, std::cos(angle)));
    least = std::min(least, static_cast<double>(function.evaluate(w, Vec3f(0, 0, 1))));
  }
  return 4 * kPi * least;
}

Float4 loaded(const float* from) {
  Float4 four;
  std::memcpy(&four, from, sizeof(four));
  return four;
}

// Sums of values times their weights; four at a time, as the compiler may not change their order.
float weighted(const float* weights, const float* values, int count) {
  Float4 four{};
  int j = 0;
  for (; j + 4 <= count; j += 4)
    four += loaded(weights + j) * loaded(values + j);
  float sum = (four[0] + four[1]) + (four[2] + four[3]);
  for (; j < count; ++j)
    sum += weights[j] * values[j];
  return sum;
}
// The same of colours, [value][3].
Rgb weightedColours(const float* weights, const float* values, int count) {
  Float4 even{}, odd{};  // the fourth belongs to the next colour
  int j = 0;
  for (; j + 2 < count; j += 2) {
    even += weights[j] * loaded(values + 3 * j);
    odd += weights[j + 1] * loaded(values + 3 * j + 3);
  }
  even += odd;
  Rgb sum(even[0], even[1], even[2]);
  for (; j < count; ++j)
    sum += weights[j] * Rgb(values[3 * j], values[3 * j + 1], values[3 * j + 2]);
  return sum;
}

}  // namespace

PhaseReader::PhaseReader(const LightFieldLayout& layout, const transport::Medium& medium, int phase)
    : m_layout(layout), m_medium(medium), m_phase(phase) {
  if (layout.basis == Basis::view) return;
  const auto& function = medium.phases()[static_cast<std::size_t>(phase)];
  const bool smooths = layout.angularKernel != sphere::AngularKernel::none &&
                       layout.direction != sphere::DirectionDeposit::kernel;
  const bool restores = layout.evaluate == Evaluate::perStep && layout.merge == Merge::sampled;
  if (restores && !layout.keepsMeans()) {
    restore();
    return;
  }
  if (layout.basis == Basis::histogram && !smooths && !layout.keepsMeans()) {
    tabulate(function);
    return;
  }
  // Smoothing the light is smoothing the phase function: both convolve with the kernel.
  sphere::LegendreMoments moments = phase::legendreMoments(function);
  if (smooths)
    moments =
        sphere::convolved(moments, sphere::kernelMoments(layout.directionKernel(), moments.size()));
  if (layout.basis == Basis::sphericalHarmonics) {
    // Convolving with a function of the angle scales degree l by its moment (Funk & Hecke): exact
    // up to the order.
    m_harmonics.emplace(layout.order);
    moments = sphere::cutAt(moments, layout.order, leastShare(function));
    for (int i = 0; i < m_harmonics->count(); ++i) {
      const auto l = static_cast<std::size_t>(sphere::SphericalHarmonics::degree(i));
      m_moments.push_back(static_cast<float>(moments[l]));
    }
    return;
  }
  if (layout.keepsMeans()) {
    m_lobes.emplace(moments);
    return;
  }
  const sphere::ZonalTable smooth(moments);
  const auto smoothed = [smooth](const Vec3f& w, const Vec3f& wo) {
    return static_cast<double>(smooth(w, wo));
  };
  m_bins.push_back({1.0f, sphere::BinWeights(layout.binShares(), smoothed, smooth.meanCosine(),
                                             sphere::Reconstruction::smooth)});
}

// Lobe by lobe: each has a width and a side of its own, which decide where its table is fine.
void PhaseReader::tabulate(const phase::PhaseFunction& function) {
  for (int i = 0; i < function.lobes(); ++i) {
    const phase::Draine& lobe = function.lobe(i);
    // cos^2 is about as narrow as a lobe of mean cosine 1/2.
    const double g =
        lobe.alpha() > 0 ? std::copysign(std::max(0.5, std::abs(lobe.g())), lobe.g()) : lobe.g();
    const auto evaluate = [&lobe](const Vec3f& w, const Vec3f& wo) {
      return static_cast<double>(lobe.evaluate(w, wo));
    };
    m_bins.push_back(
        {static_cast<float>(function.weight(i)),
         sphere::BinWeights(m_layout.binShares(), evaluate, g, sphere::Reconstruction::smooth)});
  }
}

// The paper's way: bins are restored to K directions (eq. 8), and the phase function is taken at
// those (eq. 9).
void PhaseReader::restore() {
  const int rows = static_cast<int>(std::lround(std::sqrt(m_layout.directions / 8.0)));
  const sphere::Partition bins(m_layout.rows), cells(rows);
  const bool smooths = m_layout.direction != sphere::DirectionDeposit::kernel;
  for (const double share : sphere::smoothingMatrix(
           bins, cells, smooths ? m_layout.directionKernel() : sphere::SmoothingKernel()))
    m_restored.push_back(static_cast<float>(share));
  for (int k = 0; k < cells.size(); ++k)
    m_directions.push_back(cells.center(k));
}

void PhaseReader::turn(const Vec3f& wo, Toward& toward) const {
  toward.wo = wo;
  const auto bins = static_cast<std::size_t>(m_layout.bins());
  if (!m_bins.empty()) {
    toward.weights.resize(bins);
    m_bins[0].table.weights(wo, toward.weights.data());
    if (m_bins.size() > 1) {
      toward.scratch.resize(bins);
      m_bins[1].table.weights(wo, toward.scratch.data());
      for (std::size_t j = 0; j < bins; ++j)
        toward.weights[j] =
            m_bins[0].weight * toward.weights[j] + m_bins[1].weight * toward.scratch[j];
    }
  } else if (m_harmonics) {
    toward.weights.resize(bins);
    m_harmonics->evaluate(wo, toward.weights.data());
    for (std::size_t i = 0; i < bins; ++i)
      toward.weights[i] *= m_moments[i];
  } else if (!m_directions.empty()) {
    const auto& function = m_medium.phases()[static_cast<std::size_t>(m_phase)];
    toward.weights.assign(bins, 0.0f);
    for (std::size_t k = 0; k < m_directions.size(); ++k) {
      const float f = function.evaluate(m_directions[k], wo);
      const float* shares = m_restored.data() + k * bins;
      for (std::size_t j = 0; j < bins; ++j)
        toward.weights[j] += f * shares[j];
    }
  }
}

Rgb PhaseReader::read(const float* set, const Toward& toward) const {
  const int channelCount = m_layout.channels;
  if (m_layout.basis == Basis::view) return channels(set + m_phase * channelCount);
  const int bins = m_layout.bins();
  if (!m_lobes) {
    const float* weights = toward.weights.data();
    return channelCount == 1 ? Rgb(weighted(weights, set, bins))
                             : weightedColours(weights, set, bins);
  }
  Rgb sum(0.0f);
  for (int j = 0; j < bins; ++j) {
    const float f = lobe(set, j, toward.wo);
    for (int c = 0; c < channelCount; ++c)
      sum[c] += f * set[j * channelCount + c];
  }
  return channels(&sum.x);
}

Rgb PhaseReader::readBin(const float* set, int bin, const Toward& toward) const {
  const float f =
      m_lobes ? lobe(set, bin, toward.wo) : toward.weights[static_cast<std::size_t>(bin)];
  return f * channels(set + bin * m_layout.channels);
}

// The bin's light as a lobe about its mean direction, as wide as that mean is short. The phase
// function at the mean direction itself, which is what the paper takes, forgets the spread within
// the bin (METHOD.md section 5.5: 7 to 10 % dark at g = 0.7); it is the limit of no spread.
float PhaseReader::lobe(const float* set, int bin, const Vec3f& wo) const {
  const float* sum = set + m_layout.bins() * m_layout.channels + 3 * bin;
  const float power = binPower(m_layout, set, bin);
  const Vec3f direction(sum[0], sum[1], sum[2]);
  const float length = std::sqrt(glm::dot(direction, direction));
  // No light, or light from all sides: no direction, and a lobe without one is even.
  if (!(std::abs(power) > 0.0f) || !(length > 1e-30f)) return (*m_lobes)(0.0f, wo, wo);
  // Both are negative where sharpening took away more than there was.
  return (*m_lobes)(length / std::abs(power), direction * ((power < 0 ? -1.0f : 1.0f) / length),
                    wo);
}

}  // namespace photosphere::estimators
