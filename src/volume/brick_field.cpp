#include <cstring>
#include <map>

#include "photosphere/core/parallel.h"
#include "photosphere/volume/bricks.h"

namespace photosphere::volume {

namespace {

// Bytes of a value, by which bricks of one constant find each other.
template <class T>
std::string keyOf(const T& value) {
  return std::string(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

template <class T>
BrickField<T>::BrickField(const Vec3i& origin, const Vec3i& bricks,
                          const std::vector<Vec3i>& candidates,
                          const std::function<void(const Vec3i& brick, T* nodes)>& fetch)
    : m_origin(origin), m_bricks(bricks), m_extent(Vec3f(bricks) * static_cast<float>(kEdge)) {
  m_table.assign(static_cast<std::size_t>(bricks.x) * static_cast<std::size_t>(bricks.y) *
                     static_cast<std::size_t>(bricks.z),
                 -1);
  std::map<std::string, std::int32_t> constants;
  const T zero(0.0f);
  // Batches bound the scratch memory; appending in order keeps the layout independent of threads.
  constexpr std::size_t kBatch = 1024;
  std::vector<T> scratch(std::min(kBatch, candidates.size()) * kBrickSize);
  std::vector<std::uint8_t> uniform(kBatch);
  for (std::size_t first = 0; first < candidates.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, candidates.size() - first);
    parallelFor(count, 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        T* nodes = scratch.data() + i * kBrickSize;
        fetch(candidates[first + i], nodes);
        uniform[i] =
            std::all_of(nodes, nodes + kBrickSize, [&](const T& v) { return v == nodes[0]; });
      }
    });
    for (std::size_t i = 0; i < count; ++i) {
      const T* nodes = scratch.data() + i * kBrickSize;
      if (uniform[i] && nodes[0] == zero) continue;
      const Vec3i& b = candidates[first + i];
      std::int32_t& entry = m_table[tableIndex(b.x, b.y, b.z)];
      const auto next = static_cast<std::int32_t>(m_nodes.size() / kBrickSize);
      if (uniform[i]) {
        const auto [known, fresh] = constants.emplace(keyOf(nodes[0]), next);
        entry = known->second;
        if (!fresh) continue;
      } else {
        entry = next;
      }
      m_nodes.insert(m_nodes.end(), nodes, nodes + kBrickSize);
      m_constant.push_back(uniform[i]);
    }
  }
  m_nodes.shrink_to_fit();
}

template class BrickField<float>;
template class BrickField<Vec4f>;

}  // namespace photosphere::volume
