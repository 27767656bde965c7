#include "photosphere/transport/support_lattice.h"

#include <fmt/format.h>

#include <bit>

#include "photosphere/core/error.h"
#include "photosphere/core/interrupt.h"

namespace photosphere::transport {

namespace {

// Bits of one brick's voxels: a word for each z, in which x and y take three bits each.
using Mask = std::array<std::uint64_t, 8>;
constexpr std::uint64_t kFirstX = 0x0101010101010101u, kLastX = kFirstX << 7;

// Marks voxels in bricks that come into being when first touched.
class Marks {
 public:
  explicit Marks(const Vec3i& bricks)
      : m_bricks(bricks),
        m_table(static_cast<std::size_t>(bricks.x) * static_cast<std::size_t>(bricks.y) *
                    static_cast<std::size_t>(bricks.z),
                -1) {}

  void mark(const Vec3i& v) {
    brick(Vec3i(v.x >> 3, v.y >> 3, v.z >> 3))[static_cast<std::size_t>(v.z & 7)] |=
        std::uint64_t{1} << ((v.y & 7) * 8 + (v.x & 7));
  }
  // Marks what lies beside a mark, in x, y and z: a cube of three voxels about each. What would lie
  // outside the table is left out.
  Marks dilated() const { return alongZ(alongY(alongX(*this))); }

  template <class Visit>
  void forEach(const Visit& visit) const {
    forEachBrick([&](const Vec3i& b, const Mask& mask) {
      for (int z = 0; z < 8; ++z)
        for (std::uint64_t bits = mask[static_cast<std::size_t>(z)]; bits != 0; bits &= bits - 1) {
          const int i = std::countr_zero(bits);
          visit(Vec3i(b.x * 8 + (i & 7), b.y * 8 + (i >> 3), b.z * 8 + z));
        }
    });
  }

 private:
  template <class Visit>
  void forEachBrick(const Visit& visit) const {
    for (int z = 0; z < m_bricks.z; ++z)
      for (int y = 0; y < m_bricks.y; ++y)
        for (int x = 0; x < m_bricks.x; ++x) {
          const std::int32_t brick = m_table[tableIndex({x, y, z})];
          if (brick >= 0) visit(Vec3i(x, y, z), m_masks[static_cast<std::size_t>(brick)]);
        }
  }
  Mask& brick(const Vec3i& b) {
    std::int32_t& brick = m_table[tableIndex(b)];
    if (brick < 0) {
      brick = static_cast<std::int32_t>(m_masks.size());
      m_masks.emplace_back();
    }
    return m_masks[static_cast<std::size_t>(brick)];
  }
  // The bits that leave a brick on either side are handed to its neighbours along that axis.
  template <class Inside, class Up, class Down>
  static Marks along(int axis, const Marks& marks, const Inside& inside, const Up& up,
                     const Down& down) {
    Marks out(marks.m_bricks);
    const auto add = [&](const Vec3i& b, const Mask& mask) {
      if (b[axis] < 0 || b[axis] >= marks.m_bricks[axis] || mask == Mask{}) return;
      Mask& into = out.brick(b);
      for (std::size_t z = 0; z < 8; ++z)
        into[z] |= mask[z];
    };
    marks.forEachBrick([&](const Vec3i& b, const Mask& mask) {
      Vec3i step(0);
      step[axis] = 1;
      add(b, inside(mask));
      add(b + step, up(mask));
      add(b - step, down(mask));
    });
    return out;
  }
  template <class Word>
  static auto wordwise(const Word& word) {
    return [word](const Mask& mask) {
      Mask out;
      for (std::size_t z = 0; z < 8; ++z)
        out[z] = word(mask[z]);
      return out;
    };
  }
  static Marks alongX(const Marks& marks) {
    return along(0, marks, wordwise([](std::uint64_t w) {
                   return w | (w & ~kLastX) << 1 | (w & ~kFirstX) >> 1;
                 }),
                 wordwise([](std::uint64_t w) { return (w & kLastX) >> 7; }),
                 wordwise([](std::uint64_t w) { return (w & kFirstX) << 7; }));
  }
  static Marks alongY(const Marks& marks) {
    return along(1, marks, wordwise([](std::uint64_t w) { return w | w << 8 | w >> 8; }),
                 wordwise([](std::uint64_t w) { return w >> 56; }),
                 wordwise([](std::uint64_t w) { return w << 56; }));
  }
  static Marks alongZ(const Marks& marks) {
    return along(
        2, marks,
        [](const Mask& mask) {
          Mask out = mask;
          for (std::size_t z = 0; z < 7; ++z) {
            out[z] |= mask[z + 1];
            out[z + 1] |= mask[z];
          }
          return out;
        },
        [](const Mask& mask) { return Mask{mask[7]}; },
        [](const Mask& mask) { return Mask{0, 0, 0, 0, 0, 0, 0, mask[0]}; });
  }

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

// @param source  of the lattice, for a message
void checkTable(const Vec3d& bricks, const std::string& source) {
  const double bytes = 4.0 * bricks.x * bricks.y * bricks.z;
  if (bytes > 4.0 * 1024 * 1024 * 1024)
    throw MemoryError(fmt::format(
        "a light lattice over {:.6g} x {:.6g} x {:.6g} voxels needs more than 4 GiB for its table"
        "{}; raise estimator.light_voxel, remove stray voxels far from the smoke, or mend a "
        "transform that makes voxels small",
        bricks.x * 8, bricks.y * 8, bricks.z * 8, source));
}

// The smoke, and the grid of the smallest voxels in it.
std::string describeSmoke(const Medium& medium) {
  const Vec3d extent = medium.bounds().extent();
  std::string text =
      fmt::format(": the smoke spans {:.4g} x {:.4g} x {:.4g} m", extent.x, extent.y, extent.z);
  for (const MediumVolume& volume : medium.volumes()) {
    if (volume.density.empty()) continue;
    const double edge = volume::finestSpacing(volume.localFromNode);
    if (edge > medium.voxelEdge() * (1 + 1e-9)) continue;
    return text + fmt::format(", an edge of the voxels of '{}' {:.4g} m", volume.name, edge);
  }
  return text;
}

void markBox(const Vec3d& low, const Vec3d& high, Marks& marks) {
  const Vec3i first(glm::floor(low)), last(glm::floor(high));
  throwIfInterrupted();
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
  checkTable(bricks, describeSmoke(medium));
  m_bricks = Vec3i(bricks);
  Marks marks(m_bricks);
  if (medium.isMoving())
    markWays(medium, m_origin, edge, marks);
  else
    markSupport(medium, m_origin, edge, marks);
  for (int i = 0; i < margin; ++i) {
    throwIfInterrupted();
    marks = marks.dilated();
  }
  marks.forEach([&](const Vec3i& v) {
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
  checkTable(Vec3d(bricks), " (a light cache's)");
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
