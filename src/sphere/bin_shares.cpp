#include "photosphere/sphere/bin_shares.h"

#include <algorithm>
#include <cmath>

#include "directions.h"
#include "photosphere/core/error.h"

namespace photosphere::sphere {

namespace {

// Rounding that may put a direction on an edge outside both of its faces.
constexpr float kEdge = 1e-6f;

// Coordinates of w along a triangle's corners, summing to 1.
template <class Triangle>
Vec3f coordinates(const Triangle& t, const Vec3f& w) {
  const Vec3f c(glm::dot(t.row[0], w), glm::dot(t.row[1], w), glm::dot(t.row[2], w));
  const float sum = c.x + c.y + c.z;
  // Directions on the far side of the sphere have no coordinates here.
  return sum > 0.0f ? c / sum : Vec3f(-1.0f);
}

float least(const Vec3f& v) {
  return glm::min(v.x, glm::min(v.y, v.z));
}

}  // namespace

BinShares::BinShares(const Partition& partition, DirectionDeposit deposit,
                     const SmoothingKernel& kernel)
    : m_partition(partition), m_deposit(deposit), m_kernel(kernel) {
  if (deposit == DirectionDeposit::kernel && !kernel.acts())
    throw ConfigError(
        "direction = \"kernel\" spreads a photon over bins by `kernel`: choose \"epanechnikov\" or "
        "\"gaussian\" for it");
  if (deposit == DirectionDeposit::nearest) return;
  for (int i = 0; i < partition.size(); ++i)
    m_centers.push_back(partition.center(i));
  if (deposit != DirectionDeposit::barycentric) return;
  mesh();
  findCandidates();
}

int BinShares::maxShares() const {
  switch (m_deposit) {
    case DirectionDeposit::nearest:
      return 1;
    case DirectionDeposit::barycentric:
      return 4;
    case DirectionDeposit::kernel:
      return m_partition.size();
  }
  return 0;
}

int BinShares::shares(const Vec3f& w, BinShare* out) const {
  switch (m_deposit) {
    case DirectionDeposit::nearest:
      break;
    case DirectionDeposit::barycentric:
      return barycentric(w, out);
    case DirectionDeposit::kernel:
      return spread(w, out);
  }
  out[0] = {m_partition.index(w), 1.0f};
  return 1;
}

Vec3d BinShares::position(const Corner& corner) const {
  return Vec3d(mirroredInto(corner.flip, m_centers[static_cast<std::size_t>(corner.cell)]));
}

// Bin centres as corners of faces. Inside an octant neighbouring rows are joined by triangles;
// across the planes that bound it four centres at a time mirror one another.
void BinShares::mesh() {
  constexpr int x = 1, y = 2, z = 4;
  const int n = m_partition.rows(), last = (n - 1) * (n - 1), end = n * n - 1;
  addFace({{0, 0}, {0, x}, {0, x | y}, {0, y}});  // about the pole
  for (int row = 0; row + 1 < n; ++row) {
    addStrip(row);
    const int first = row * row, next = (row + 1) * (row + 1);
    addFace({{first, 0}, {first, y}, {next, y}, {next, 0}});
    const int firstEnd = next - 1, nextEnd = (row + 2) * (row + 2) - 1;
    addFace({{firstEnd, 0}, {firstEnd, x}, {nextEnd, x}, {nextEnd, 0}});
  }
  for (int cell = last; cell < end; ++cell)
    addFace({{cell, 0}, {cell + 1, 0}, {cell + 1, z}, {cell, z}});
  addFace({{last, 0}, {last, y}, {last, y | z}, {last, z}});
  addFace({{end, 0}, {end, x}, {end, x | z}, {end, z}});
}

// Joins row and row + 1 of the octant: from left to right, the next corner is of the row that lags.
void BinShares::addStrip(int row) {
  const int upper = 2 * row + 1, lower = 2 * row + 3;
  const int firstUpper = row * row, firstLower = (row + 1) * (row + 1);
  int a = 0, b = 0;
  while (a + 1 < upper || b + 1 < lower) {
    const bool below = a + 1 == upper || (b + 1 < lower && (b + 1) * upper <= (a + 1) * lower);
    const Corner third = below ? Corner{firstLower + b + 1, 0} : Corner{firstUpper + a + 1, 0};
    addFace({{firstUpper + a, 0}, {firstLower + b, 0}, third});
    ++(below ? b : a);
  }
}

void BinShares::addFace(const std::vector<Corner>& corners) {
  Face face;
  face.corners = corners;
  const auto add = [&](int i, int j, int k) {
    const Vec3d a = position(corners[static_cast<std::size_t>(i)]);
    const Vec3d b = position(corners[static_cast<std::size_t>(j)]);
    const Vec3d c = position(corners[static_cast<std::size_t>(k)]);
    // Cramer's rule: rows of the inverse of the matrix whose columns are the corners.
    const double determinant = glm::dot(a, glm::cross(b, c));
    face.triangles.push_back(
        {{Vec3f(glm::cross(b, c) / determinant), Vec3f(glm::cross(c, a) / determinant),
          Vec3f(glm::cross(a, b) / determinant)},
         {i, j, k}});
  };
  add(0, 1, 2);
  if (corners.size() == 4) {
    add(0, 2, 3);
    add(0, 1, 3);
    add(1, 2, 3);
  }
  m_faces.push_back(std::move(face));
}

// Faces that meet each cell of octant 0, found by points on a fine raster in it. One that is missed
// costs time alone: faceOf then asks every face.
void BinShares::findCandidates() {
  constexpr int side = 12;
  const int cells = m_partition.size() / 8;
  m_candidates.resize(static_cast<std::size_t>(cells));
  for (int cell = 0; cell < cells; ++cell) {
    auto& list = m_candidates[static_cast<std::size_t>(cell)];
    for (int i = 0; i < side * side; ++i) {
      const int column = i % side, row = i / side;
      const Vec2d u = Vec2d(column, row) / (side - 1.0);
      const Vec3f w = glm::abs(m_partition.point(cell, u));
      const bool known = std::any_of(list.begin(), list.end(), [&](std::uint32_t f) {
        return std::any_of(m_faces[f].triangles.begin(), m_faces[f].triangles.end(),
                           [&](const Triangle& t) { return least(coordinates(t, w)) >= 0.0f; });
      });
      if (!known) list.push_back(static_cast<std::uint32_t>(bestFace(w)));
    }
  }
}

std::size_t BinShares::bestFace(const Vec3f& w) const {
  std::size_t best = 0;
  float most = -kInfinity;
  for (std::size_t f = 0; f < m_faces.size(); ++f)
    for (const Triangle& t : m_faces[f].triangles) {
      const float inside = least(coordinates(t, w));
      if (inside > most) {
        most = inside;
        best = f;
      }
    }
  return best;
}

std::size_t BinShares::faceOf(const Vec3f& w) const {
  for (const std::uint32_t f : m_candidates[static_cast<std::size_t>(m_partition.index(w))])
    for (const Triangle& t : m_faces[f].triangles)
      if (least(coordinates(t, w)) >= -kEdge) return f;
  return bestFace(w);
}

int BinShares::barycentric(const Vec3f& direction, BinShare* out) const {
  const bool zero = !(glm::dot(direction, direction) > 0.0f);
  const Vec3f w = zero ? Vec3f(0, 0, 1) : glm::abs(direction);
  const int octant = Partition::octantOf(direction), cells = m_partition.size() / 8;
  const Face& face = m_faces[faceOf(w)];
  float weights[4] = {};
  // Each way to cut the face has the direction in one of its triangles.
  const std::size_t cuts = face.triangles.size() == 4 ? 2 : 1;
  for (std::size_t cut = 0; cut < cuts; ++cut) {
    const Triangle* best = &face.triangles[2 * cut];
    Vec3f c = coordinates(*best, w);
    if (cuts == 2) {
      const Vec3f other = coordinates(face.triangles[2 * cut + 1], w);
      if (least(other) > least(c)) {
        c = other;
        best = &face.triangles[2 * cut + 1];
      }
    }
    for (int k = 0; k < 3; ++k)
      weights[best->corner[k]] += std::max(0.0f, c[k]);
  }
  const float sum = weights[0] + weights[1] + weights[2] + weights[3];
  int count = 0;
  for (std::size_t k = 0; k < face.corners.size(); ++k)
    if (weights[k] > 0.0f) {
      const Corner& corner = face.corners[k];
      out[count++] = {(octant ^ corner.flip) * cells + corner.cell, weights[k] / sum};
    }
  return count;
}

int BinShares::spread(const Vec3f& direction, BinShare* out) const {
  const Vec3f w = glm::dot(direction, direction) > 0.0f ? direction : Vec3f(0, 0, 1);
  int count = 0;
  float sum = 0.0f;
  for (std::size_t j = 0; j < m_centers.size(); ++j) {
    const float value = m_kernel(w, m_centers[j]);
    if (!(value > 0.0f)) continue;
    out[count++] = {static_cast<int>(j), value};
    sum += value;
  }
  if (count == 0) {  // narrower than the bins
    out[0] = {m_partition.index(w), 1.0f};
    return 1;
  }
  for (int i = 0; i < count; ++i)
    out[i].weight /= sum;
  return count;
}

}  // namespace photosphere::sphere
