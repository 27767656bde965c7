#include "photosphere/sphere/bin_weights.h"

#include <algorithm>
#include <cmath>

#include "cell_quadrature.h"
#include "directions.h"
#include "photosphere/core/parallel.h"
#include "reconstruction.h"

namespace photosphere::sphere {

namespace {

constexpr int kMaxSmoothBins = 512;

// Lattice edges along an octant's side for a lobe: about five to the lobe's width. A wide lobe
// needs a few for the cells' own size.
int latticeFor(double width) {
  return std::clamp(static_cast<int>(std::ceil(9.0 / width)), 8, 160);
}

}  // namespace

BinWeights::BinWeights(const BinShares& deposit, const Phase& phase, double meanCosine,
                       Reconstruction reconstruction)
    : m_partition(deposit.partition()) {
  const bool even =
      deposit.deposit() == DirectionDeposit::nearest && reconstruction == Reconstruction::constant;
  if (even || size() > kMaxSmoothBins) {
    tabulate(m_partition, phase, meanCosine);
    return;
  }
  const int rows = m_partition.rows();
  const Partition fine(rows * (rows <= 2 ? 3 : 2));
  tabulate(fine, phase, meanCosine);
  reduce(reconstruction == Reconstruction::smooth ? smoothReconstruction(deposit, fine)
                                                  : depositReconstruction(deposit, fine),
         static_cast<std::size_t>(fine.size()));
}

// Weights of fine cells become weights of bins: light in a bin is spread over the fine cells around
// it.
void BinWeights::reduce(const std::vector<double>& spread, std::size_t cells) {
  const auto bins = static_cast<std::size_t>(size());
  const std::size_t nodes = m_table.size() / cells;
  std::vector<float> reduced(nodes * bins);
  parallelFor(nodes, 8, [&](std::size_t begin, std::size_t end) {
    std::vector<double> row(bins);
    for (std::size_t k = begin; k < end; ++k) {
      std::fill(row.begin(), row.end(), 0.0);
      for (std::size_t i = 0; i < cells; ++i) {
        const double w = static_cast<double>(m_table[k * cells + i]);
        for (std::size_t j = 0; j < bins; ++j)
          row[j] += w * spread[i * bins + j];
      }
      for (std::size_t j = 0; j < bins; ++j)
        reduced[k * bins + j] = static_cast<float>(row[j]);
    }
  });
  m_table = std::move(reduced);
}

void BinWeights::tabulate(const Partition& cellsOf, const Phase& phase, double meanCosine) {
  const double width = std::max(0.005, 1 - std::abs(meanCosine));
  const float side = meanCosine < 0 ? -1.0f : 1.0f;
  m_lattice = latticeFor(width);
  const std::size_t count = static_cast<std::size_t>(cellsOf.size());
  const std::size_t cells = count / 8;
  const std::size_t nodes = static_cast<std::size_t>((m_lattice + 1) * (m_lattice + 2) / 2);
  m_table.resize(nodes * count);
  const CellQuadrature quadrature(cellsOf, width);

  std::vector<Vec3f> directions;
  for (int j = 0; j <= m_lattice; ++j)
    for (int i = 0; i + j <= m_lattice; ++i)
      directions.emplace_back(glm::normalize(Vec3d(i, j, m_lattice - i - j)));
  parallelFor(nodes, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      float* row = &m_table[k * count];
      double sum = 0;
      for (std::size_t bin = 0; bin < count; ++bin) {
        // A cell of another octant sees wo as its mirror image in octant 0 sees wo mirrored.
        const Vec3f wo = mirroredInto(static_cast<int>(bin / cells), directions[k]);
        const double mean = quadrature.mean(static_cast<int>(bin % cells), phase, wo, side * wo);
        row[bin] = static_cast<float>(mean);
        sum += mean;
      }
      // Quadrature leaves up to 1e-4: the histogram must not gain or lose energy by it.
      sum *= 4 * kPi / static_cast<double>(count);
      if (sum > 0)
        for (std::size_t bin = 0; bin < count; ++bin)
          row[bin] = static_cast<float>(static_cast<double>(row[bin]) / sum);
    }
  });
}

const float* BinWeights::node(int i, int j) const {
  // Row j holds the nodes i = 0 .. m_lattice - j. Rounding may ask for one past the long edge, with
  // a weight of about nothing.
  j = std::min(j, m_lattice);
  i = std::min(i, m_lattice - j);
  const int index = j * (m_lattice + 1) - j * (j - 1) / 2 + i;
  return &m_table[static_cast<std::size_t>(index) * static_cast<std::size_t>(size())];
}

void BinWeights::weights(const Vec3f& wo, float* out) const {
  const Vec3f a = glm::abs(wo);
  const float sum = a.x + a.y + a.z;
  const float scale = sum > 0 ? static_cast<float>(m_lattice) / sum : 0.0f;
  const int i = static_cast<int>(a.x * scale), j = static_cast<int>(a.y * scale);
  const float fx = a.x * scale - static_cast<float>(i), fy = a.y * scale - static_cast<float>(j);
  // The triangle of the lattice square: below or above its diagonal.
  const bool below = fx + fy <= 1;
  const float* const p = below ? node(i, j) : node(i + 1, j + 1);
  const float* const q = node(i + 1, j);
  const float* const r = node(i, j + 1);
  const float wq = below ? fx : 1 - fy;
  const float wr = below ? fy : 1 - fx;
  const float wp = 1 - wq - wr;

  const int cells = size() / 8, flip = Partition::octantOf(wo);
  for (int octant = 0; octant < 8; ++octant) {
    float* const target = out + (octant ^ flip) * cells;
    const int first = octant * cells;
    for (int k = 0; k < cells; ++k)
      target[k] = wp * p[first + k] + wq * q[first + k] + wr * r[first + k];
  }
}

}  // namespace photosphere::sphere
