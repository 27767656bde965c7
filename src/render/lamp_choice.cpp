#include "lamp_choice.h"

#include <algorithm>
#include <cmath>

#include "photosphere/core/parallel.h"

namespace photosphere::render {

namespace {

// Entries of the table at most, and cells along an edge of the smoke.
constexpr double kMostEntries = 1 << 22;
constexpr int kMostCells = 16;

// What a lamp sends to a sphere, up to a factor near 1, and 0 only where none of its light gets
// [W]. What is asked of so many lamps and cells must cost little: far from a lamp its brightest
// place in the sphere tells it, moved back to the centre.
double powerToward(const lights::Light& lamp, const lights::BoundingSphere& around) {
  if (const std::optional<lights::Place> place = lamp.place()) {
    const double distance = glm::length(place->center - around.center);
    const double size = around.radius + place->extent;
    if (distance > 2 * size) {
      const double back = (distance - size) / distance;
      return lamp.reach(around).fluence * back * back * kPi * around.radius * around.radius;
    }
  }
  return lights::largestPower(lamp.roughPower(around));
}

}  // namespace

LampChoice::LampChoice(const transport::Medium& medium,
                       const std::vector<const lights::Light*>& lamps)
    : m_lamps(lamps.size()) {
  const Box3d& box = medium.bounds();
  if (box.empty() || lamps.empty()) return;
  const int cells = std::clamp(
      static_cast<int>(std::cbrt(kMostEntries / static_cast<double>(lamps.size()))), 1, kMostCells);
  const Vec3d extent = glm::max(box.extent(), Vec3d(1e-30));
  const Vec3d cell = extent / static_cast<double>(cells);
  m_dims = Vec3i(cells);
  m_origin = Vec3f(box.min);
  m_inverseCell = Vec3f(1.0 / cell);
  // A little wider than the cell, so that rounding leaves no place without its lamps.
  const double radius = 0.51 * glm::length(cell);
  const auto count = static_cast<std::size_t>(cells) * static_cast<std::size_t>(cells) *
                     static_cast<std::size_t>(cells);
  m_cumulative.assign(count * m_lamps, 0.0f);
  parallelFor(count, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<double> sums(m_lamps);
    for (std::size_t i = begin; i < end; ++i) {
      const auto n = static_cast<std::size_t>(cells);
      const std::size_t row = i / n;
      const std::size_t slice = row / n;
      const Vec3d place(static_cast<double>(i % n), static_cast<double>(row % n),
                        static_cast<double>(slice));
      const lights::BoundingSphere around{box.min + (place + 0.5) * cell, radius};
      double sum = 0;
      for (std::size_t lamp = 0; lamp < m_lamps; ++lamp) {
        sum += powerToward(*lamps[lamp], around);
        sums[lamp] = sum;
      }
      if (!(sum > 0) || !std::isfinite(sum)) continue;
      for (std::size_t lamp = 0; lamp < m_lamps; ++lamp)
        m_cumulative[i * m_lamps + lamp] = static_cast<float>(sums[lamp] / sum);
    }
  });
}

std::size_t LampChoice::cellOf(const Vec3f& p) const {
  const Vec3i c = glm::clamp(Vec3i((p - m_origin) * m_inverseCell), Vec3i(0), m_dims - 1);
  return (static_cast<std::size_t>(c.z) * static_cast<std::size_t>(m_dims.y) +
          static_cast<std::size_t>(c.y)) *
             static_cast<std::size_t>(m_dims.x) +
         static_cast<std::size_t>(c.x);
}

LampChoice::Drawn LampChoice::at(const Vec3f& p, double u) const {
  if (m_cumulative.empty()) return {};
  const float* first = m_cumulative.data() + cellOf(p) * m_lamps;
  const float* chosen = std::upper_bound(first, first + m_lamps, static_cast<float>(u));
  if (chosen == first + m_lamps) return {};
  const auto lamp = static_cast<std::size_t>(chosen - first);
  return {lamp, *chosen - (lamp > 0 ? chosen[-1] : 0.0f)};
}

}  // namespace photosphere::render
