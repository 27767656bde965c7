#include "photosphere/transport/emission.h"

#include <algorithm>
#include <cmath>

namespace photosphere::transport {

namespace {

using EmissionField = volume::BrickField<Vec4f>;
constexpr int kNodes = EmissionField::kNodes;

// Integral over a brick of a node's interpolation weight, per axis: nodes on its faces share
// theirs with the neighbour.
float share(int i) {
  return i == 0 || i == kNodes - 1 ? 0.5f : 1.0f;
}

// Calls visit(node, weight) for the nodes of a brick in storage order, until it returns false.
template <class Visit>
void forEachNode(const Visit& visit) {
  for (int z = 0; z < kNodes; ++z)
    for (int y = 0; y < kNodes; ++y)
      for (int x = 0; x < kNodes; ++x)
        if (!visit(Vec3i(x, y, z), share(x) * share(y) * share(z))) return;
}

// Draws from a node's hat, 1 - |x| on [-1, 1], cut at the brick's faces.
float hat(int i, float u) {
  if (i == 0) return 1.0f - std::sqrt(1.0f - u);
  if (i == kNodes - 1) return std::sqrt(1.0f - u) - 1.0f;
  return u < 0.5f ? std::sqrt(2.0f * u) - 1.0f : 1.0f - std::sqrt(2.0f - 2.0f * u);
}

double cellVolume(const Mat4d& m) {
  return std::abs(glm::determinant(Mat3d(m)));
}

}  // namespace

Emission::Emission(const std::vector<const VolumeEmission*>& volumes, double reach)
    : m_reach(reach) {
  for (const VolumeEmission* v : volumes) {
    m_placed.push_back({&v->field, volume::NodeFromLocal(v->localFromNode), v->localFromNode});
    m_region.box.grow(volume::supportBounds(v->field, v->localFromNode));
    m_region.spacing = std::min(m_region.spacing, volume::finestSpacing(v->localFromNode));
    const double watts = 4.0 * kPi * cellVolume(v->localFromNode);
    const Vec3i& bricks = v->field.bricks();
    for (int z = 0; z < bricks.z; ++z)
      for (int y = 0; y < bricks.y; ++y)
        for (int x = 0; x < bricks.x; ++x) {
          const std::int32_t brick = v->field.brickAt({x, y, z});
          if (brick < 0) continue;
          glm::dvec4 sum(0.0);
          const Vec4f* node = v->field.nodes(brick);
          forEachNode([&](const Vec3i&, float weight) {
            m_grey = m_grey && node->x == node->y && node->y == node->z;
            sum += glm::dvec4(*node++ * weight);
            return true;
          });
          m_power += watts * Vec3d(sum);
          m_birthPower += watts * sum.w;
          m_sources.push_back({static_cast<std::uint32_t>(m_placed.size() - 1), brick,
                               Vec3i(x, y, z) * EmissionField::kEdge, m_birthPower});
        }
  }
  m_region.box = volume::widened(m_region.box, reach);
}

void Emission::markCells(const volume::MajorantGrid& lattice) {
  m_cells.assign(lattice.size(), 0);
  for (const Placed& v : m_placed)
    volume::forEachCell(*v.field, [&](const Vec3i& lowest, int edge, float) {
      lattice.forEachOverlapped(v.localFromNode, lowest, edge,
                                [&](std::size_t cell) { m_cells[cell] = 1; });
    });
  lattice.widen(m_cells, m_reach);
}

Emission::Birth Emission::birth(double u, const Vec3f& offset) const {
  const double target = u * m_birthPower;
  const auto found =
      std::upper_bound(m_sources.begin(), m_sources.end(), target,
                       [](double value, const Source& s) { return value < s.cumulative; });
  const Source& source = found == m_sources.end() ? m_sources.back() : *found;
  const Placed& placed = m_placed[source.volume];
  const Vec4f* nodes = placed.field->nodes(source.brick);
  const double before = &source == m_sources.data() ? 0.0 : (&source - 1)->cumulative;
  auto left =
      static_cast<float>((target - before) / (4.0 * kPi * cellVolume(placed.localFromNode)));
  Vec3i node(0);
  Vec4f value(0.0f);
  // The last node that emits stands in where rounding carries past the end.
  const Vec4f* at = nodes;
  forEachNode([&](const Vec3i& candidate, float weight) {
    const float own = weight * at->w;
    if (own > 0.0f) {
      node = candidate;
      value = *at;
      left -= own;
    }
    ++at;
    return !(own > 0.0f) || left >= 0.0f;
  });
  Birth birth;
  birth.volume = source.volume;
  const Vec3f within(hat(node.x, offset.x), hat(node.y, offset.y), hat(node.z, offset.z));
  birth.origin =
      Vec3f(transformPoint(placed.localFromNode, Vec3d(source.lowest + node) + Vec3d(within)));
  // The interpolant is a sum of hats: with the node's own colour the mean over nodes is exact, and
  // no channel passes the largest.
  birth.power = Rgb(value) * (static_cast<float>(m_birthPower) / value.w);
  return birth;
}

void Emission::hash(Hasher& hasher) const {
  for (const Placed& v : m_placed) {
    hasher.numbers(&v.localFromNode[0][0], 16);
    const Vec3i& bricks = v.field->bricks();
    hasher.numbers(&bricks.x, 3);
  }
  for (const Source& s : m_sources) {
    hasher.number(s.volume);
    hasher.numbers(&s.lowest.x, 3);
    hasher.numbers(&m_placed[s.volume].field->nodes(s.brick)->x, 4 * EmissionField::kBrickSize);
  }
}

std::uint64_t Emission::memoryBytes() const {
  std::uint64_t bytes = m_cells.size() + m_sources.size() * sizeof(Source);
  for (const Placed& v : m_placed)
    bytes += v.field->memoryBytes();
  return bytes;
}

}  // namespace photosphere::transport
