#include "photosphere/transport/support_lattice.h"

#include <fmt/format.h>

#include "photosphere/core/error.h"

namespace photosphere::transport {

namespace {

// Bits of one brick's voxels.
using Mask = std::array<std::uint64_t, 8>;

// Marks voxels in bricks that come into being when first touched.
class Marks {
 public:
  explicit Marks(const Vec3i& bricks)
      : m_bricks(bricks),
        m_table(static_cast<std::size_t>(bricks.x) * static_cast<std::size_t>(bricks.y) *
                    static_cast<std::size_t>(bricks.z),
                -1) {}

  void mark(const Vec3i& v) {
    const Vec3i b(v.x >> 3, v.y >> 3, v.z >> 3);
    std::int32_t& brick = m_table[tableIndex(b)];
    if (brick < 0) {
      brick = static_cast<std::int32_t>(m_masks.size());
      m_masks.emplace_back();
    }
    m_masks[static_cast<std::size_t>(brick)][static_cast<std::size_t>(v.z & 7)] |=
        std::uint64_t{1} << ((v.y & 7) * 8 + (v.x & 7));
  }
  bool marked(const Vec3i& v) const {
    if (v.x < 0 || v.y < 0 || v.z < 0) return false;
    const Vec3i b(v.x >> 3, v.y >> 3, v.z >> 3);
    if (b.x >= m_bricks.x || b.y >= m_bricks.y || b.z >= m_bricks.z) return false;
    const std::int32_t brick = m_table[tableIndex(b)];
    return brick >= 0 &&
           (m_masks[static_cast<std::size_t>(brick)][static_cast<std::size_t>(v.z & 7)] >>
            ((v.y & 7) * 8 + (v.x & 7))) &
               1;
  }
  template <class Visit>
  void forEach(const Visit& visit) const {
    for (int z = 0; z < m_bricks.z; ++z)
      for (int y = 0; y < m_bricks.y; ++y)
        for (int x = 0; x < m_bricks.x; ++x) {
          const std::int32_t brick = m_table[tableIndex({x, y, z})];
          if (brick < 0) continue;
          const Mask& mask = m_masks[static_cast<std::size_t>(brick)];
          for (int i = 0; i < 512; ++i)
            if (mask[static_cast<std::size_t>(i >> 6)] >> (i & 63) & 1)
              visit(Vec3i(x * 8 + (i & 7), y * 8 + (i >> 3 & 7), z * 8 + (i >> 6)));
        }
  }

 private:
  std::size_t tableIndex(const Vec3i& b) const {
    return (static_cast<std::size_t>(b.z) * static_cast<std::size_t>(m_bricks.y) +
            static_cast<std::size_t>(b.y)) *
               static_cast<std::size_t>(m_bricks.x) +
           static_cast<std::size_t>(b.x);
  }
  Vec3i m_bricks;
  std::vector<std::int32_t> m_table;
  std::vector<Mask> m_masks;
};

void checkTable(const Vec3d& bricks) {
  const double bytes = 4.0 * bricks.x * bricks.y * bricks.z;
  if (bytes > 4.0 * 1024 * 1024 * 1024)
    throw MemoryError(fmt::format(
        "a light lattice over {:.0f} x {:.0f} x {:.0f} voxels needs more than 4 GiB for its table; "
        "raise estimator.light_voxel or remove stray voxels far from the smoke",
        bricks.x * 8, bricks.y * 8, bricks.z * 8));
}

void markBox(const Vec3d& low, const Vec3d& high, Marks& marks) {
  const Vec3i first(glm::floor(low)), last(glm::floor(high));
  for (int z = first.z; z <= last.z; ++z)
    for (int y = first.y; y <= last.y; ++y)
      for (int x = first.x; x <= last.x; ++x)
        marks.mark({x, y, z});
}

// Marks every lattice voxel that a cell with extinction overlaps.
void markSupport(const Medium& medium, const Vec3d& origin, double edge, Marks& marks) {
  for (const MediumVolume& v : medium.volumes()) {
    const auto& field = v.density;
    if (field.empty() || !(v.densityScale > 0)) continue;
    const Mat4d& m = v.localFromNode;
    const Vec3d axes = glm::abs(Vec3d(m[0])) + glm::abs(Vec3d(m[1])) + glm::abs(Vec3d(m[2]));
    volume::forEachCell(field, [&](const Vec3i& cell, int size, float) {
      const Vec3d center = (transformPoint(m, Vec3d(cell) + 0.5 * size) - origin) / edge;
      const Vec3d half = axes * (0.5 * size / edge) * (1 - 1e-6);
      markBox(center - half, center + half, marks);
    });
  }
}

// The same over the shutter: where the majorants know that smoke may come.
void markWays(const Medium& medium, const Vec3d& origin, double edge, Marks& marks) {
  const volume::MajorantGrid& cells = medium.majorants();
  const Vec3d size(cells.cellSize());
  Vec3i c(0);
  for (c.z = 0; c.z < cells.dims().z; ++c.z)
    for (c.y = 0; c.y < cells.dims().y; ++c.y)
      for (c.x = 0; c.x < cells.dims().x; ++c.x) {
        if (!(cells.majorant(c) > 0.0f)) continue;
        const Vec3d low = (cells.bounds().min + Vec3d(c) * size - origin) / edge;
        // The last cell of a row may end beyond the smoke.
        const Vec3d high = glm::min(low + size / edge, (cells.bounds().max - origin) / edge) - 1e-6;
        markBox(low + 1e-6, high, marks);
      }
}

}  // namespace

SupportLattice::SupportLattice(const Medium& medium, double edge, int margin,
                               const std::function<bool(const Vec3d&)>& keep)
    : m_edge(edge), m_inverseEdge(static_cast<float>(1.0 / edge)) {
  if (medium.bounds().empty()) return;
  // One voxel beyond the margin on every side, so that a flight's neighbours exist in the table.
  const int border = margin + 1;
  m_origin = medium.bounds().min - edge * border;
  m_originF = Vec3f(m_origin);
  const Vec3d voxels = glm::ceil(medium.bounds().extent() / edge) + 2.0 * border + 1.0;
  const Vec3d bricks = glm::ceil(voxels / 8.0);
  checkTable(bricks);
  m_bricks = Vec3i(bricks);
  Marks base(m_bricks);
  if (medium.isMoving())
    markWays(medium, m_origin, edge, base);
  else
    markSupport(medium, m_origin, edge, base);
  Marks dilated(m_bricks);
  base.forEach([&](const Vec3i& v) {
    bool inside = true;  // all neighbours marked: they dilate for this voxel
    for (int z = -1; z <= 1 && inside; ++z)
      for (int y = -1; y <= 1 && inside; ++y)
        for (int x = -1; x <= 1 && inside; ++x)
          inside = base.marked(v + Vec3i(x, y, z));
    const int reach = inside ? 0 : margin;
    for (int z = -reach; z <= reach; ++z)
      for (int y = -reach; y <= reach; ++y)
        for (int x = -reach; x <= reach; ++x)
          dilated.mark(v + Vec3i(x, y, z));
  });
  dilated.forEach([&](const Vec3i& v) {
    if (!keep || keep(m_origin + (Vec3d(v) + 0.5) * m_edge)) m_voxels.push_back(v);
  });
  number();
}

SupportLattice::SupportLattice(const Vec3d& origin, double edge, const Vec3i& bricks,
                               const std::vector<Vec3i>& active)
    : m_origin(origin),
      m_edge(edge),
      m_inverseEdge(static_cast<float>(1.0 / edge)),
      m_originF(Vec3f(origin)),
      m_bricks(bricks),
      m_voxels(active) {
  checkTable(Vec3d(bricks));
  number();
}

// Fills the tables from m_voxels.
void SupportLattice::number() {
  m_table.assign(static_cast<std::size_t>(m_bricks.x) * static_cast<std::size_t>(m_bricks.y) *
                     static_cast<std::size_t>(m_bricks.z),
                 -1);
  for (std::size_t i = 0; i < m_voxels.size(); ++i) {
    const Vec3i& v = m_voxels[i];
    const Vec3i b(v.x >> 3, v.y >> 3, v.z >> 3);
    std::int32_t& brick = m_table[tableIndex(b)];
    if (brick < 0) {
      brick = static_cast<std::int32_t>(m_activeBricks.size());
      m_activeBricks.push_back(b);
      m_numbers.resize(m_numbers.size() + 512, -1);
    }
    m_numbers[static_cast<std::size_t>(brick) * 512 +
              static_cast<std::size_t>((v.z & 7) * 64 + (v.y & 7) * 8 + (v.x & 7))] =
        static_cast<std::int32_t>(i);
  }
}

std::uint64_t SupportLattice::memoryBytes() const {
  return m_table.size() * 4 + m_numbers.size() * 4 + m_voxels.size() * sizeof(Vec3i) +
         m_activeBricks.size() * sizeof(Vec3i);
}

}  // namespace photosphere::transport
