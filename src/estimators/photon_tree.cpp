// The nearest photons of a point: columns in the order of a kd-tree.

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <numeric>

#include "deposit.h"
#include "photosphere/estimators/photon_set.h"

namespace photosphere::estimators {

namespace {

constexpr std::size_t kLeafPhotons = 16;
// The ball of the nearest photons is at least this part of the largest one: photons that coincide
// with the point would otherwise make an infinite density.
constexpr float kSmallestBall = 1e-3f;

// What nanoflann asks of the photons.
struct Positions {
  const PhotonColumns& photons;
  std::size_t kdtree_get_point_count() const { return photons.count; }
  float kdtree_get_pt(std::size_t i, std::size_t axis) const { return photons.position[axis][i]; }
  template <class B>
  bool kdtree_get_bbox(B&) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Positions>,
                                                 Positions, 3, std::uint32_t>;

using Found = std::pair<float, std::uint32_t>;  // squared distance, photon

// Result set of a bounded search: a heap with the farthest photon on top.
class Nearest {
 public:
  Nearest(std::vector<Found>& heap, std::size_t capacity, float limitSquared)
      : m_heap(heap), m_capacity(capacity), m_limit(limitSquared) {
    m_heap.clear();
  }
  bool full() const { return m_heap.size() == m_capacity; }
  std::size_t size() const { return m_heap.size(); }
  float worstDist() const { return full() ? m_heap.front().first : m_limit; }
  bool addPoint(float squared, std::uint32_t photon) {
    if (!(squared < worstDist())) return true;
    if (full()) {
      std::pop_heap(m_heap.begin(), m_heap.end());
      m_heap.back() = {squared, photon};
    } else {
      m_heap.emplace_back(squared, photon);
    }
    std::push_heap(m_heap.begin(), m_heap.end());
    return true;
  }

 private:
  std::vector<Found>& m_heap;
  std::size_t m_capacity;
  float m_limit;
};

class NearestSet final : public PhotonSet {
 public:
  NearestSet(const PhotonColumns& photons, SpatialKernel kernel, std::uint32_t neighbors,
             double radius)
      : m_photons(photons),
        m_positions{m_photons},
        m_tree(3, m_positions, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafPhotons)),
        m_kernel(kernel),
        m_neighbors(std::min<std::size_t>(neighbors, photons.count)),
        m_radiusSquared(static_cast<float>(radius * radius)),
        m_unitVolume(static_cast<float>(kernelVolume(kernel, 1.0))) {
    // Photons of a leaf side by side in memory.
    m_photons = m_photons.inOrder(m_tree.vAcc);
    std::iota(m_tree.vAcc.begin(), m_tree.vAcc.end(), 0u);
    m_treeBytes = m_tree.usedMemory(m_tree);
  }

  Rgb scattered(const Vec3f& p, const Vec3f& wo, const Lobe& lobe) const override {
    if (m_photons.count == 0) return Rgb(0.0f);
    thread_local std::vector<Found> found;
    // One more than are used: the ball ends at the first photon left out, whose own weight would
    // make the estimate larger by 1/k in the mean.
    Nearest nearest(found, m_neighbors + 1, m_radiusSquared);
    m_tree.findNeighbors(nearest, &p.x, nanoflann::SearchParams());
    const float squared = nearest.full() ? std::max(found.front().first,
                                                    kSmallestBall * kSmallestBall * m_radiusSquared)
                                         : m_radiusSquared;
    const float inverse = 1.0f / squared;
    const std::size_t last = nearest.full() ? found.front().second : m_photons.count;
    Rgb sum(0.0f);
    for (const Found& f : found) {
      if (f.second == last) continue;
      const float w = kernelWeight(m_kernel, f.first * inverse);
      if (w > 0.0f)
        sum += w * lobe.evaluate(m_photons.directionOf(f.second), wo) * m_photons.powerOf(f.second);
    }
    return sum * (inverse / (std::sqrt(squared) * m_unitVolume));
  }
  const PhotonColumns& photons() const override { return m_photons; }
  std::uint64_t memoryBytes() const override { return m_photons.memoryBytes() + m_treeBytes; }

 private:
  PhotonColumns m_photons;
  Positions m_positions;
  Tree m_tree;
  SpatialKernel m_kernel;
  std::size_t m_neighbors;
  float m_radiusSquared, m_unitVolume;
  std::uint64_t m_treeBytes = 0;
};

}  // namespace

std::unique_ptr<PhotonSet> makeNearestSet(const PhotonColumns& photons, SpatialKernel kernel,
                                          std::uint32_t neighbors, double radius) {
  return std::make_unique<NearestSet>(photons, kernel, neighbors, radius);
}

}  // namespace photosphere::estimators
