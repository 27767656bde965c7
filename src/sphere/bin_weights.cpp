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

// Scale on which a lobe varies at its peak [rad].
double widthOf(double meanCosine) {
  return std::max(0.005, 1 - std::abs(meanCosine));
}

// Lattice edges along an octant's side for a lobe: about five to the lobe's width. A wide lobe
// needs a few for the cells' own size.
int latticeFor(double width) {
  return std::clamp(static_cast<int>(std::ceil(9.0 / width)), 8, 160);
}

}  // namespace

// What the nodes are computed of, and those that were.
class BinWeights::Nodes {
 public:
  /// @param cells   on which the phase function is averaged
  /// @param spread  share of each bin's light in each cell, [cell][bin]; none where cells are bins
  Nodes(const Partition& cells, int bins, const Phase& phase, double meanCosine,
        std::vector<double> spread)
      : m_cells(static_cast<std::size_t>(cells.size())),
        m_bins(static_cast<std::size_t>(bins)),
        m_edges(latticeFor(widthOf(meanCosine))),
        m_phase(phase),
        m_side(meanCosine < 0 ? -1.0f : 1.0f),
        m_quadrature(cells, widthOf(meanCosine)),
        m_spread(std::move(spread)),
        m_states(std::make_unique<std::atomic<State>[]>(count())),
        m_weights(std::make_unique_for_overwrite<float[]>(count() * m_bins)) {}

  int edges() const { return m_edges; }
  /// The weights of node i of row j; of the nearest one past the lattice's ends.
  const float* at(int i, int j) {
    j = std::min(j, m_edges);
    i = std::min(i, m_edges - j);
    const std::size_t k = index(i, j);
    if (m_states[k].load(std::memory_order_acquire) != State::ready) compute(k, i, j);
    return &m_weights[k * m_bins];
  }

 private:
  enum class State : char { none, written, ready };

  // Row j holds the nodes i = 0 .. m_edges - j.
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j * (m_edges + 1) - j * (j - 1) / 2 + i);
  }
  std::size_t count() const { return index(0, m_edges) + 1; }
  std::vector<float> average(const Vec3f& direction) const;
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
std::vector<float> BinWeights::Nodes::average(const Vec3f& direction) const {
  std::vector<float> means(m_cells);
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
  return means;
}

// Threads that want the same node at once all compute it, and one writes it.
void BinWeights::Nodes::compute(std::size_t k, int i, int j) {
  std::vector<float> row = average(glm::normalize(Vec3d(i, j, m_edges - i - j)));
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
  const auto nodes = [&](const Partition& cells, std::vector<double> spread) {
    return std::make_shared<Nodes>(cells, size(), phase, meanCosine, std::move(spread));
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

int BinWeights::latticeSize() const {
  return m_nodes->edges();
}

void BinWeights::weights(const Vec3f& wo, float* out) const {
  const Vec3f a = glm::abs(wo);
  const float sum = a.x + a.y + a.z;
  const float scale = sum > 0 ? static_cast<float>(latticeSize()) / sum : 0.0f;
  const int i = static_cast<int>(a.x * scale), j = static_cast<int>(a.y * scale);
  const float fx = a.x * scale - static_cast<float>(i), fy = a.y * scale - static_cast<float>(j);
  // The triangle of the lattice square: below or above its diagonal. Rounding may ask for a node
  // past the long edge, with a weight of about nothing.
  const bool below = fx + fy <= 1;
  const float* const p = below ? m_nodes->at(i, j) : m_nodes->at(i + 1, j + 1);
  const float* const q = m_nodes->at(i + 1, j);
  const float* const r = m_nodes->at(i, j + 1);
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
