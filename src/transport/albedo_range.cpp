#include "albedo_range.h"

#include <algorithm>

namespace photosphere::transport {

namespace {

using AlbedoField = volume::BrickField<float>;

// Value of a node of the lattice; 0 outside it.
float node(const AlbedoField& field, const Vec3i& n) {
  const Vec3i b = glm::min(n >> 3, field.bricks() - 1);
  const Vec3i in = n - b * AlbedoField::kEdge;
  if (std::min({n.x, n.y, n.z}) < 0 || std::max({in.x, in.y, in.z}) >= AlbedoField::kNodes)
    return 0.0f;
  const std::int32_t brick = field.brickAt(b);
  return brick < 0
             ? 0.0f
             : field.nodes(brick)[(in.z * AlbedoField::kNodes + in.y) * AlbedoField::kNodes + in.x];
}

// Largest node between two corners, both inclusive.
float largestBetween(const AlbedoField& field, const Vec3i& low, const Vec3i& high) {
  float most = 0.0f;
  for (int z = low.z; z <= high.z; ++z)
    for (int y = low.y; y <= high.y; ++y)
      for (int x = low.x; x <= high.x; ++x)
        most = std::max(most, node(field, {x, y, z}));
  return most;
}

}  // namespace

float largestAlbedo(const MediumVolume& volume) {
  if (volume.density.empty()) return 0.0f;
  if (volume.albedoFields.empty()) return maxComponent(volume.albedo);
  float everywhere = 0.0f;
  for (const AlbedoField& field : volume.albedoFields)
    volume::forEachNode(field, [&](float value) { everywhere = std::max(everywhere, value); });
  // A cell of density covers a box of albedo nodes. Faces that only touch are bounded from inside.
  const Mat4d albedoFromDensity = glm::inverse(volume.localFromAlbedoNode) * volume.localFromNode;
  const Vec3d reach = glm::abs(Vec3d(albedoFromDensity[0])) +
                      glm::abs(Vec3d(albedoFromDensity[1])) + glm::abs(Vec3d(albedoFromDensity[2]));
  float most = 0.0f;
  volume::forEachCell(volume.density, [&](const Vec3i& lowest, int edge, float densest) {
    if (!(densest > 0.0f) || most >= everywhere) return;
    const Vec3d center = transformPoint(albedoFromDensity, Vec3d(lowest) + 0.5 * edge);
    const Vec3d half = 0.5 * edge * reach - 1e-4;
    const Vec3i low(glm::floor(center - half)), high(glm::ceil(center + half));
    for (const AlbedoField& field : volume.albedoFields)
      if (!field.empty())
        most = std::max(most, largestBetween(field, glm::max(low, Vec3i(0)),
                                             glm::min(high, field.bricks() * AlbedoField::kEdge)));
  });
  return std::min(most, 1.0f);
}

}  // namespace photosphere::transport
