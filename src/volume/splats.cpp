#include "splats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "photosphere/core/error.h"

namespace photosphere::volume {

namespace {

constexpr double kMostVoxels = 0x1p28;  // 1 GiB of floats
constexpr double kRadiusPerSpacing = 2;

double sphereVolume(double radius) {
  return 4.0 / 3.0 * kPi * radius * radius * radius;
}

// True when some particle has a radius that can be used.
bool hasRadii(const Attribute* pscale) {
  if (!pscale) return false;
  for (std::size_t i = 0; i < pscale->size(); ++i)
    if (pscale->number(i) > 0 && std::isfinite(pscale->number(i))) return true;
  return false;
}

// One radius for particles that bring none.
double radiusFromSpacing(const ParticleSet& particles, double spacing) {
  if (spacing > 0) return kRadiusPerSpacing * spacing;
  // One particle, or most of them coincide.
  const double extent = particles.size() ? maxComponent(particles.bounds().extent()) : 0;
  return extent > 0 && std::isfinite(extent) ? extent / 100 : 1.0;
}

const Attribute* scalarColumn(const ParticleSet& particles, std::string_view name) {
  const Attribute* column = particles.find(name);
  return column && column->arity >= 1 && column->size() >= particles.size() ? column : nullptr;
}

}  // namespace

void summarizeRadii(const std::vector<Blob>& blobs, RasterizeResult& result) {
  if (blobs.empty()) return;
  std::vector<double> radii(blobs.size());
  for (std::size_t i = 0; i < blobs.size(); ++i)
    radii[i] = blobs[i].radius;
  const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::nth_element(radii.begin(), middle, radii.end());
  result.radiusMedian = *middle;
  result.radiusMin = *std::min_element(radii.begin(), radii.end());
  result.radiusMax = *std::max_element(radii.begin(), radii.end());
}

namespace {

// Calls visit(i, radius, mass) for every particle.
template <class Visit>
void forEachParticle(const ParticleSet& particles, const RasterizeOptions& options,
                     RasterizeResult& result, const Visit& visit) {
  const Attribute* pscale = scalarColumn(particles, "pscale");
  const Attribute* mass = scalarColumn(particles, "mass");
  const Attribute* density = scalarColumn(particles, "density");
  const bool anyRadii = hasRadii(pscale);
  const bool ownRadii = options.radius == 0 && anyRadii;
  double shared = options.radius;
  if (options.radius == 0 && !ownRadii) {
    result.radiusFromSpacing = true;
    result.spacing = medianSpacing(particles);
    shared = radiusFromSpacing(particles, result.spacing);
  }
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const double radius = ownRadii ? pscale->number(i) : shared;
    // The mass of a density is that of the particle's own ball, whatever radius it is spread over.
    const double ball = sphereVolume(anyRadii ? pscale->number(i) : radius);
    visit(i, radius, mass ? mass->number(i) : density ? density->number(i) * ball : 1.0);
  }
}

}  // namespace

std::vector<Blob> collectBlobs(const ParticleSet& particles, const RasterizeOptions& options,
                               RasterizeResult& result) {
  std::vector<Blob> blobs;
  blobs.reserve(particles.size());
  forEachParticle(particles, options, result, [&](std::size_t i, double radius, double mass) {
    const Vec3d& p = particles.positions[i];
    const bool valid = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) &&
                       std::isfinite(radius) && radius >= 0 && std::isfinite(mass) && mass >= 0;
    if (!valid) {
      if (result.skipped++ == 0) result.firstSkipped = i;
      return;
    }
    blobs.push_back({p, radius, mass});
    result.massParticles += mass;
  });
  summarizeRadii(blobs, result);
  return blobs;
}

std::vector<double> particleMasses(const ParticleSet& particles, const RasterizeOptions& options) {
  std::vector<double> masses(particles.size());
  RasterizeResult ignored;
  forEachParticle(particles, options, ignored,
                  [&](std::size_t i, double, double mass) { masses[i] = mass; });
  return masses;
}

double chooseVoxelSize(const std::vector<Blob>& blobs, const RasterizeOptions& options,
                       double radiusMedian) {
  if (options.voxelSize > 0) return options.voxelSize;
  if (blobs.empty()) return 1.0;
  Box3d box;
  double volume = 0, radiusMax = 0;
  for (const Blob& blob : blobs) {
    box.grow(blob.position - blob.radius);
    box.grow(blob.position + blob.radius);
    volume += sphereVolume(blob.radius);
    radiusMax = std::max(radiusMax, blob.radius);
  }
  const Vec3d extent = box.extent();
  const double half = 0.5 * (radiusMedian > 0 ? radiusMedian : radiusMax);
  const double largest = maxComponent(extent);
  const double size = half > 0 ? half : largest > 0 ? largest / 256 : 1.0;
  const double occupied = std::min(volume, extent.x * extent.y * extent.z);
  // Nor so small that indices leave 30 bits.
  const double coordinate = maxComponent(glm::max(glm::abs(box.min), glm::abs(box.max)));
  return std::max(
      {size, std::cbrt(occupied / kMostVoxels), largest * 0x1p-29, coordinate * 0x1p-50});
}

}  // namespace photosphere::volume
