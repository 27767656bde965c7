#include "light_depth.h"

#include <algorithm>
#include <array>

#include "photosphere/core/interrupt.h"
#include "photosphere/core/parallel.h"
#include "photosphere/core/sampling.h"

namespace photosphere::render {

using transport::Medium;

namespace {

// A lamp whose nearest smoke is this much nearer than the smoke's centre would need far more rays
// than there are voxels.
constexpr double kNearest = 0.25;
// Bricks of the table, active or not.
constexpr double kMostBricks = 1 << 28;
constexpr int kEdge = volume::BrickField<float>::kEdge;
constexpr int kNodes = volume::BrickField<float>::kNodes;
constexpr std::size_t kBrickSize = volume::BrickField<float>::kBrickSize;

template <class Visit>
void forEachCorner(const Box3d& box, const Visit& visit) {
  for (int corner = 0; corner < 8; ++corner)
    visit(box.corner(corner));
}

}  // namespace

// Coordinates in nodes, before the first node is subtracted.
Vec3d LightDepth::nodePosition(const Vec3d& p) const {
  const Vec3d q = p - Vec3d(m_center);
  const double depth = glm::dot(q, Vec3d(m_axis));
  const double scale =
      static_cast<double>(m_raysPerLength) / (1.0 + depth * static_cast<double>(m_inverseDistance));
  return {glm::dot(q, Vec3d(m_right)) * scale, glm::dot(q, Vec3d(m_up)) * scale,
          depth * static_cast<double>(m_nodesPerLength)};
}

std::optional<LightDepth> LightDepth::plan(const Medium& medium, const lights::Light& light) {
  const Box3d& box = medium.bounds();
  LightDepth depth;
  depth.m_center = Vec3f(0.5 * (box.min + box.max));
  const lights::Illumination in = light.illuminate(depth.m_center, Vec2f(0.5f));
  if (!(in.distance > 0.0f)) return std::nullopt;
  depth.m_axis = in.direction;
  const Frame frame = Frame::fromZ(in.direction);
  depth.m_right = frame.toWorld({1, 0, 0});
  depth.m_up = frame.toWorld({0, 1, 0});
  depth.m_inverseDistance = in.distance < kInfinity ? 1.0f / in.distance : 0.0f;

  double nearest = 1.0, farthest = 1.0, slope = 0.0;
  forEachCorner(box, [&](const Vec3d& p) {
    const double along = 1.0 + glm::dot(p - Vec3d(depth.m_center), Vec3d(depth.m_axis)) *
                                   static_cast<double>(depth.m_inverseDistance);
    nearest = std::min(nearest, along);
    farthest = std::max(farthest, along);
  });
  if (!(nearest >= kNearest)) return std::nullopt;
  depth.m_raysPerLength = static_cast<float>(farthest / medium.voxelEdge());
  depth.m_nodesPerLength = static_cast<float>(1.0 / medium.voxelEdge());
  forEachCorner(box, [&](const Vec3d& p) {
    const Vec3d node = depth.nodePosition(p);
    slope = std::max(slope, (node.x * node.x + node.y * node.y));
  });
  // A step along the slanting rays at the rim is no longer than a voxel either.
  const double rim = std::sqrt(slope) / static_cast<double>(depth.m_raysPerLength) *
                     static_cast<double>(depth.m_inverseDistance);
  depth.m_nodesPerLength *= static_cast<float>(std::sqrt(1.0 + rim * rim));
  depth.chooseLattice(box);
  if (depth.m_bricks == Vec3i(0)) return std::nullopt;
  depth.findBricks(medium.majorants());
  return depth;
}

void LightDepth::chooseLattice(const Box3d& box) {
  Box3d nodes;
  forEachCorner(box, [&](const Vec3d& p) { nodes.grow(nodePosition(p)); });
  m_first = Vec3f(glm::floor(nodes.min) - 1.0);
  // Just inside: smoke that is cut off at its box ends there.
  constexpr float kInset = 1e-3f;
  m_lowest = Vec2f(nodes.min.x, nodes.min.y) + kInset;
  m_highest = glm::max(m_lowest, Vec2f(nodes.max.x, nodes.max.y) - kInset);
  const Vec3d bricks = glm::ceil((nodes.max - Vec3d(m_first) + 1.0) / static_cast<double>(kEdge));
  if (bricks.x * bricks.y * bricks.z > kMostBricks) return;
  m_bricks = Vec3i(bricks);
}

// Bricks that a cell with extinction reaches into.
void LightDepth::findBricks(const volume::MajorantGrid& majorants) {
  std::vector<bool> reached(static_cast<std::size_t>(m_bricks.x) *
                            static_cast<std::size_t>(m_bricks.y) *
                            static_cast<std::size_t>(m_bricks.z));
  const auto index = [&](int x, int y, int z) {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(m_bricks.x) +
            static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(m_bricks.z) +
           static_cast<std::size_t>(z);
  };
  const Vec3i& dims = majorants.dims();
  const Vec3d size(majorants.cellSize());
  for (int z = 0; z < dims.z; ++z)
    for (int y = 0; y < dims.y; ++y) {
      throwIfInterrupted();
      for (int x = 0; x < dims.x; ++x) {
        if (!(majorants.majorant({x, y, z}) > 0.0f)) continue;
        Box3d cell, nodes;
        cell.min = majorants.bounds().min + Vec3d(x, y, z) * size;
        cell.max = cell.min + size;
        forEachCorner(cell, [&](const Vec3d& p) { nodes.grow(nodePosition(p) - Vec3d(m_first)); });
        // A hundredth of a node covers the rounding of a lookup.
        const Vec3i lo = glm::max(Vec3i(glm::floor((nodes.min - 0.01) / 8.0)), Vec3i(0));
        const Vec3i hi = glm::min(Vec3i(glm::floor((nodes.max + 0.01) / 8.0)), m_bricks - 1);
        for (int by = lo.y; by <= hi.y; ++by)
          for (int bx = lo.x; bx <= hi.x; ++bx)
            for (int bz = lo.z; bz <= hi.z; ++bz)
              reached[index(bx, by, bz)] = true;
      }
    }
  for (int y = 0; y < m_bricks.y; ++y)
    for (int x = 0; x < m_bricks.x; ++x)
      for (int z = 0; z < m_bricks.z; ++z)
        if (reached[index(x, y, z)]) m_active.push_back({x, y, z});
}

std::uint64_t LightDepth::predictedBytes() const {
  // Nodes twice: as they are computed, and as they are kept.
  return m_active.size() * (2 * kBrickSize * sizeof(float) + sizeof(Vec3i)) +
         static_cast<std::uint64_t>(m_bricks.x) * static_cast<std::uint64_t>(m_bricks.y) *
             static_cast<std::uint64_t>(m_bricks.z) * sizeof(std::int32_t);
}

// Marches the 9 x 9 rays of one column of bricks, [first, end) of m_active, away from the lamp.
// There is nothing to add between its bricks. along(o, d) gives the extinction by distance.
template <class Along>
void LightDepth::marchColumn(const Along& along, float step, std::size_t first, std::size_t end,
                             float* nodes) const {
  const Vec3i column = m_active[first] * kEdge;
  const float h = 1.0f / m_nodesPerLength;
  for (int j = 0; j < kNodes; ++j)
    for (int i = 0; i < kNodes; ++i) {
      const Vec2f ray = glm::clamp(Vec2f(column.x + i, column.y + j) + Vec2f(m_first.x, m_first.y),
                                   m_lowest, m_highest) /
                        m_raysPerLength;
      const Vec3f inPlane = m_right * ray.x + m_up * ray.y;
      // The place at a depth z behind the centre is linear in z.
      const Vec3f perDepth = m_axis + inPlane * m_inverseDistance;
      const auto extinction = along(m_center + inPlane, perDepth);
      const float length = h * std::sqrt(glm::dot(perDepth, perDepth));
      const int parts = std::max(1, static_cast<int>(std::ceil(length / step * 0.9999f)));
      const float part = h / static_cast<float>(parts);
      const float worth = length / static_cast<float>(parts);
      float depth = 0.0f;
      float* node = nodes + j * kNodes + i;
      for (std::size_t b = first; b < end; ++b) {
        const float start = (static_cast<float>(m_active[b].z * kEdge) + m_first.z) * h;
        for (int k = 0; k < kNodes; ++k, node += kNodes * kNodes) {
          *node = depth;
          if (k == kEdge) continue;  // the next brick's first node
          float sum = 0.0f;
          for (int s = 0; s < parts; ++s)
            sum += extinction(start + static_cast<float>(k) * h +
                              (static_cast<float>(s) + 0.5f) * part);
          depth += sum * worth;
        }
      }
    }
}

void LightDepth::fill(const Medium& medium, float step, int channel,
                      const std::optional<transport::Moment>& when) {
  const auto whole = [&](auto time) {
    fillFrom([&, time](const Vec3f& o, const Vec3f& d) { return medium.alongRay(o, d, time); },
             step);
  };
  const auto single = [&](auto time) {
    fillFrom(
        [&, time](const Vec3f& o, const Vec3f& d) {
          return [&medium, time, channel, o, d](float t) {
            const Vec3f p = o + d * t;
            // Where the channels share no colour, this reads each volume; their sum is not asked.
            return medium.channels(p, 0.0f, time)[channel];
          };
        },
        step);
  };
  if (channel < 0)
    when ? whole(*when) : whole(transport::Still{});
  else
    when ? single(*when) : single(transport::Still{});
}

template <class Along>
void LightDepth::fillFrom(const Along& along, float step) {
  std::vector<std::size_t> columns;
  for (std::size_t i = 0; i < m_active.size(); ++i)
    if (i == 0 || m_active[i].x != m_active[i - 1].x || m_active[i].y != m_active[i - 1].y)
      columns.push_back(i);
  const std::size_t count = columns.size();
  columns.push_back(m_active.size());
  std::vector<float> nodes(m_active.size() * kBrickSize);
  parallelFor(count, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      throwIfInterrupted();
      marchColumn(along, step, columns[c], columns[c + 1], nodes.data() + columns[c] * kBrickSize);
    }
  });
  // Bricks by number, for the field that asks by place.
  const Vec3i* firstBrick = m_active.data();
  std::vector<std::size_t> columnStart(static_cast<std::size_t>(m_bricks.x) *
                                       static_cast<std::size_t>(m_bricks.y));
  const auto columnOf = [&](const Vec3i& b) {
    return static_cast<std::size_t>(b.y) * static_cast<std::size_t>(m_bricks.x) +
           static_cast<std::size_t>(b.x);
  };
  for (std::size_t c = 0; c < count; ++c)
    columnStart[columnOf(firstBrick[columns[c]])] = columns[c];
  m_field = Field(Vec3i(0), m_bricks, m_active, [&](const Vec3i& brick, float* out) {
    std::size_t i = columnStart[columnOf(brick)];
    while (m_active[i].z != brick.z)
      ++i;
    std::copy_n(nodes.data() + i * kBrickSize, kBrickSize, out);
  });
  m_active = {};
}

}  // namespace photosphere::render
