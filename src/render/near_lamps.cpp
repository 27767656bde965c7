#include "near_lamps.h"

#include <cmath>

namespace photosphere::render {

namespace {

// Of a lamp's ball over the smoke's. Wider balls cost more points than they save noise.
constexpr double kRadius = 0.1;

}  // namespace

NearLamps::NearLamps(const transport::Medium& medium,
                     const std::vector<const lights::Light*>& lamps)
    : m_lamps(lamps.size()) {
  if (medium.bounds().empty()) return;
  const double radius = kRadius * transport::boundingSphere(medium).radius;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const std::optional<lights::Place> place = lamps[i]->place();
    if (!place || !(place->extent < 0.5 * radius)) continue;
    const Vec3d nearest = medium.bounds().nearest(place->center);
    if (!(glm::length(place->center - nearest) < radius)) continue;
    m_lamps[i] = {Vec3f(place->center), static_cast<float>(radius)};
    m_none = false;
  }
}

std::optional<NearLamps::Drawn> NearLamps::draw(const Lamp& lamp, const Vec3f& o, const Vec3f& d,
                                                float length, float u) {
  const Vec3f toLamp = lamp.center - o;
  const float nearest = glm::dot(toLamp, d);
  const Vec3f aside = toLamp - d * nearest;
  const float squared = glm::dot(aside, aside);
  const float radius = lamp.radius;
  if (!(squared < radius * radius)) return std::nullopt;
  const float half = std::sqrt(radius * radius - squared);
  const float begin = glm::max(0.0f, nearest - half), end = glm::min(length, nearest + half);
  if (!(begin < end)) return std::nullopt;
  // Rays through the lamp itself have no nearest distance to draw with.
  const float scale = glm::max(std::sqrt(squared), 1e-3f * radius);
  const auto cumulative = [scale](float s) { return s / (scale + std::abs(s)); };
  const float low = cumulative(begin - nearest), high = cumulative(end - nearest);
  const float c = low + (high - low) * u;
  const float s = scale * c / (1.0f - std::abs(c));
  const float distance = glm::clamp(nearest + s, begin, end);
  const float from = scale + std::abs(s);
  const float density = scale / (from * from * (high - low));
  return Drawn{distance, lamp.share(squared + s * s) / density};
}

}  // namespace photosphere::render
