#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>

#include "photosphere/core/parallel.h"
#include "photosphere/volume/rasterize.h"

namespace photosphere::volume {

namespace {

constexpr std::size_t kQueries = 20'000;

// What nanoflann asks of a point set. Non-finite positions are left out.
struct Points {
  const std::vector<Vec3d>& positions;
  std::vector<std::uint32_t> finite;

  std::size_t kdtree_get_point_count() const { return finite.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return positions[finite[i]][static_cast<int>(axis)];
  }
  template <class B>
  bool kdtree_get_bbox(B&) const {
    return false;
  }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points>,
                                                 Points, 3, std::uint32_t>;

double nearestOther(const Tree& tree, const Points& points, std::uint32_t query) {
  std::uint32_t index[2] = {query, query};
  double squared[2] = {0, 0};
  const Vec3d& p = points.positions[points.finite[query]];
  const std::size_t found = tree.knnSearch(&p[0], 2, index, squared);
  // Of two coincident particles either may come first; the second distance is 0 then as well.
  return found == 2 ? std::sqrt(squared[1]) : 0.0;
}

}  // namespace

double medianSpacing(const ParticleSet& particles) {
  Points points{particles.positions, {}};
  points.finite.reserve(particles.size());
  for (std::size_t i = 0; i < particles.size(); ++i)
    if (isPlace(particles.positions[i])) points.finite.push_back(static_cast<std::uint32_t>(i));
  const std::size_t count = points.finite.size();
  if (count < 2) return 0;
  const Tree tree(3, points, nanoflann::KDTreeSingleIndexAdaptorParams(32));
  const std::size_t queries = std::min(count, kQueries);
  std::vector<double> distances(queries);
  parallelFor(queries, 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      distances[i] = nearestOther(tree, points, static_cast<std::uint32_t>(i * count / queries));
  });
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(queries / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

}  // namespace photosphere::volume
