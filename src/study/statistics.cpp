#include "photosphere/study/statistics.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "photosphere/core/types.h"
#include "photosphere/image/metrics.h"

namespace photosphere::study {

namespace {

using Gram = std::vector<std::vector<double>>;

// Means over the seeds but one (`without` = the number of seeds leaves none out).
struct Split {
  double diagonal = 0, offDiagonal = 0;
};

Split split(const Gram& gram, std::size_t without) {
  Split sums;
  std::size_t count = 0;
  for (std::size_t i = 0; i < gram.size(); ++i) {
    if (i == without) continue;
    ++count;
    sums.diagonal += gram[i][i];
    for (std::size_t j = 0; j < i; ++j)
      if (j != without) sums.offDiagonal += 2 * gram[i][j];
  }
  const auto n = static_cast<double>(count);
  sums.diagonal /= n;
  sums.offDiagonal /= n * (n - 1);
  return sums;
}

// Jackknife (Quenouille, Tukey 1958): pseudo-values act as independent estimates.
template <class Function>
Estimate jackknife(const Gram& gram, const Function& statistic) {
  const std::size_t n = gram.size();
  const double all = statistic(split(gram, n));
  if (n < 3) return {all, -kInfinity, kInfinity};
  std::vector<double> pseudo;
  for (std::size_t i = 0; i < n; ++i)
    pseudo.push_back(static_cast<double>(n) * all -
                     static_cast<double>(n - 1) * statistic(split(gram, i)));
  Estimate e = meanEstimate(pseudo);
  const double half = e.high - e.value;
  return {all, all - half, all + half};
}

}  // namespace

Spread spreadOf(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return {0.5 * (values[(n - 1) / 2] + values[n / 2]), values.front(), values.back()};
}

double relativeError(const ErrorFigures& figures) {
  return std::sqrt(std::max(0.0, figures.relMse.value));
}

double studentT95(int degrees) {
  static constexpr std::array<double, 30> kTable = {
      12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228,
      2.201,  2.179, 2.160, 2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086,
      2.080,  2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045, 2.042};
  if (degrees < 1) return kInfinity;
  if (degrees <= 30) return kTable[static_cast<std::size_t>(degrees - 1)];
  // Expansion about the normal quantile (Abramowitz & Stegun 26.7.5), exact to 1e-4 here.
  const double z = 1.959964, v = degrees;
  return z + (z * z * z + z) / (4 * v) +
         (5 * std::pow(z, 5) + 16 * z * z * z + 3 * z) / (96 * v * v);
}

Estimate meanEstimate(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  if (values.empty()) return {};
  double mean = 0, squares = 0;
  for (const double v : values)
    mean += v / n;
  for (const double v : values)
    squares += (v - mean) * (v - mean);
  if (values.size() < 2) return {mean, -kInfinity, kInfinity};
  const double half =
      studentT95(static_cast<int>(values.size()) - 1) * std::sqrt(squares / (n - 1) / n);
  return {mean, mean - half, mean + half};
}

ErrorFigures errorFigures(const std::vector<Planes>& seeds, const Planes& reference,
                          const Planes& referenceVariance, std::span<const unsigned char> mask) {
  image::MeasureOptions options;
  options.mask = mask;
  options.referenceVariance = referenceVariance;
  const int width = reference.empty() ? 0 : static_cast<int>(reference[0].size());
  ErrorFigures figures;
  Gram gram(seeds.size(), std::vector<double>(seeds.size()));
  std::vector<double> errors, ratios;
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const image::ErrorMetrics m = image::measure(seeds[i], reference, width, Vec2i(0), options);
    gram[i][i] = m.relMse;
    figures.referenceNoise = m.referenceNoise;
    errors.push_back(m.unbiasedRelMse);
    ratios.push_back(m.meanRatio);
    for (std::size_t j = 0; j < i; ++j)
      gram[i][j] = gram[j][i] = image::relativeProduct(seeds[i], seeds[j], reference, mask);
  }
  const double noise = figures.referenceNoise;
  figures.relMse = meanEstimate(errors);
  figures.meanRatio = meanEstimate(ratios);
  figures.biasSquared = jackknife(gram, [&](const Split& s) { return s.offDiagonal - noise; });
  figures.variance = jackknife(gram, [](const Split& s) { return s.diagonal - s.offDiagonal; });
  return figures;
}

}  // namespace photosphere::study
