#include "photosphere/sphere/bin_weights.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>
#include <utility>
#include <vector>

#include "cell_quadrature.h"
#include "directions.h"
#include "reconstruction.h"

namespace photosphere::sphere {

namespace {

constexpr int kMaxSmoothBins = 512;

// Lattice edges along an octant's side for a lobe: about five to the lobe's width. A wide lobe
// needs a few for the cells' own size.
int latticeFor(double width) {
  return std::clamp(static_cast<int>(std::ceil(9.0 / width)), 8, 160);
}

// Node k of a lattice of `edges` along its side. Row j holds the nodes i = 0 .. edges - j.
std::size_t nodeIndex(int edges, int i, int j) {
  return static_cast<std::size_t>(j * (edges + 1) - j * (j - 1) / 2 + i);
}

}  // namespace

// What the nodes are computed of, and those that were.
class BinWeights::Nodes {
 public:
  /// @param cells   on which the phase function is averaged
  /// @param spread  share of each bin's light in each cell, [cell][bin]; none where cells are bins
  Nodes(const Partition& cells, int bins, int edges, const Phase& phase, double meanCosine,
        double width, std::vector<double> spread)
      : m_cells(static_cast<std::size_t>(cells.size())),
        m_bins(static_cast<std::size_t>(bins)),
        m_edges(edges),
        m_phase(phase),
        m_side(meanCosine < 0 ? -1.0f : 1.0f),
        m_quadrature(cells, width),
        m_spread(std::move(spread)),
        m_states(std::make_unique<std::atomic<State>[]>(count())),
        m_weights(std::make_unique_for_overwrite<float[]>(count() * m_bins)) {}

  const float* at(int i, int j) {
    const std::size_t k = nodeIndex(m_edges, i, j);
    if (m_states[k].load(std::memory_order_acquire) != State::ready) compute(k, i, j);
    return &m_weights[k * m_bins];
  }

 private:
  enum class State : char { none, written, ready };

  std::size_t count() const { return nodeIndex(m_edges, 0, m_edges) + 1; }
  void average(const Vec3f& direction, std::vector<float>& means) const;
  void compute(std::size_t k, int i, int j);

  std::size_t m_cells, m_bins;
  int m_edges;
  Phase m_phase;
  float m_side;
  CellQuadrature m_quadrature;
  std::vector<double> m_spread;
  std::unique_ptr<std::atomic<State>[]> m_states;
  std::unique_ptr<float[]> m_weights;  // node after node, a weight for each bin
};

// The phase function's mean over every cell.
void BinWeights::Nodes::average(const Vec3f& direction, std::vector<float>& means) const {
  const std::size_t octant = m_cells / 8;
  double sum = 0;
  for (std::size_t cell = 0; cell < m_cells; ++cell) {
    // A cell of another octant sees wo as its mirror image in octant 0 sees wo mirrored.
    const Vec3f wo = mirroredInto(static_cast<int>(cell / octant), direction);
    const double mean =
        m_quadrature.mean(static_cast<int>(cell % octant), m_phase, wo, m_side * wo);
    means[cell] = static_cast<float>(mean);
    sum += mean;
  }
  // Quadrature leaves up to 1e-4: the histogram must not gain or lose energy by it.
  sum *= 4 * kPi / static_cast<double>(m_cells);
  if (sum > 0)
    for (float& mean : means)
      mean = static_cast<float>(static_cast<double>(mean) / sum);
}

// Threads that want the same node at once all compute it, and one writes it.
void BinWeights::Nodes::compute(std::size_t k, int i, int j) {
  std::vector<float> row(m_cells);
  average(glm::normalize(Vec3d(i, j, m_edges - i - j)), row);
  if (!m_spread.empty()) {
    // Light in a bin is spread over the cells around it.
    std::vector<double> sums(m_bins, 0.0);
    for (std::size_t cell = 0; cell < m_cells; ++cell)
      for (std::size_t bin = 0; bin < m_bins; ++bin)
        sums[bin] += static_cast<double>(row[cell]) * m_spread[cell * m_bins + bin];
    row.assign(sums.begin(), sums.end());
  }
  State expected = State::none;
  if (m_states[k].compare_exchange_strong(expected, State::written, std::memory_order_relaxed)) {
    for (std::size_t bin = 0; bin < m_bins; ++bin)
      m_weights[k * m_bins + bin] = row[bin];
    m_states[k].store(State::ready, std::memory_order_release);
  } else {
    while (m_states[k].load(std::memory_order_acquire) != State::ready)
      std::this_thread::yield();
  }
}

BinWeights::BinWeights(const BinShares& deposit, const Phase& phase, double meanCosine,
                       Reconstruction reconstruction)
    : m_partition(deposit.partition()) {
  const double width = std::max(0.005, 1 - std::abs(meanCosine));
  m_lattice = latticeFor(width);
  const auto nodes = [&](const Partition& cells, std::vector<double> spread) {
    return std::make_shared<Nodes>(cells, size(), m_lattice, phase, meanCosine, width,
                                   std::move(spread));
  };
  const bool even =
      deposit.deposit() == DirectionDeposit::nearest && reconstruction == Reconstruction::constant;
  if (even || size() > kMaxSmoothBins) {
    m_nodes = nodes(m_partition, {});
    return;
  }
  const int rows = m_partition.rows();
  const Partition fine(rows * (rows <= 2 ? 3 : 2));
  m_nodes =
      nodes(fine, reconstruction == Reconstruction::smooth ? smoothReconstruction(deposit, fine)
                                                           : depositReconstruction(deposit, fine));
}

const float* BinWeights::node(int i, int j) const {
  // Rounding may ask for one past the long edge, with a weight of about nothing.
  j = std::min(j, m_lattice);
  return m_nodes->at(std::min(i, m_lattice - j), j);
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
