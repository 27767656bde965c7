#include "near_eye.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace photosphere::estimators {

using transport::Flight;
using transport::Medium;
using transport::SupportLattice;

namespace {

// Where no directions are kept elsewhere. Error of the frame around an eye in smoke by 128, 288 and
// 512 bins: g = 0.8 and a point lamp 0.046, 0.034 and 0.031; g = 0.85 and a ball lamp near the eye
// 0.18, 0.13 and 0.11 (without 0.20 and 0.27).
constexpr int kNearRows = 6;

double edgeOf(const Medium& medium, const LightFieldLayout& layout) {
  return layout.lightVoxel * medium.voxelEdge();
}

// Distance from the eye of carriers that a reading at nearEye may come of [m]: it lies between
// voxels, and both what was smoothed and what smoothing that again leaves are asked for.
double reachOf(const LightFieldLayout& layout, double edge) {
  return (layout.nearEye + 4.0) * edge + 2.0 * layout.radius;
}

LightField partNearEye(const LightField& field, const View& view, double edge) {
  LightField part;
  part.layout = nearLayout(field.layout);
  part.photons = field.photons;
  std::vector<std::size_t> carriers;
  if (field.layout.carrier == Carrier::voxels) {
    carriers = voxelsNearEye(field.lattice, field.layout, view);
    if (!carriers.empty()) part.lattice = partOf(field.lattice, carriers);
  } else {
    const double reach = reachOf(field.layout, edge);
    for (std::size_t i = 0; i < field.particles.size(); ++i)
      if (glm::length(Vec3d(field.particles[i]) - view.eye) < reach) carriers.push_back(i);
    for (const std::size_t i : carriers)
      part.particles.push_back(field.particles[i]);
  }
  const auto stride = static_cast<std::size_t>(field.layout.valuesPerCarrier());
  for (const std::size_t i : carriers) {
    const auto first = field.values.begin() + static_cast<std::ptrdiff_t>(i * stride);
    part.values.insert(part.values.end(), first, first + static_cast<std::ptrdiff_t>(stride));
  }
  if (field.weights) {
    auto weights = std::make_shared<std::vector<float>>();
    for (const std::size_t i : carriers)
      weights->push_back((*field.weights)[i]);
    part.weights = std::move(weights);
  }
  return part;
}

class JoinedAtEye final : public InscatterSource {
 public:
  JoinedAtEye(std::unique_ptr<InscatterSource> far, std::unique_ptr<InscatterSource> near,
              const Vec3f& eye, double radius)
      : m_far(std::move(far)),
        m_near(std::move(near)),
        m_eye(eye),
        m_radiusSquared(static_cast<float>(radius * radius)) {}

  Inscatter at(const Vec3f& p, const Vec3f& wo, const transport::Coefficients& c) const override {
    const Vec3f d = p - m_eye;
    return (glm::dot(d, d) < m_radiusSquared ? *m_near : *m_far).at(p, wo, c);
  }
  bool carriesUnscattered() const override { return m_far->carriesUnscattered(); }
  double negativeShare() const override { return m_far->negativeShare(); }

 private:
  std::unique_ptr<InscatterSource> m_far, m_near;
  Vec3f m_eye;
  float m_radiusSquared;
};

}  // namespace

bool readsNearEye(const Medium& medium, const LightFieldLayout& layout, const View& view) {
  if (!(layout.nearEye > 0) || !view.hasEye || layout.evaluate != Evaluate::perView) return false;
  if (medium.isMoving()) {
    // It may come by while the shutter is open.
    const double apart = layout.nearEye * edgeOf(medium, layout);
    const Box3d& box = medium.bounds();
    return !box.empty() && glm::length(view.eye - box.nearest(view.eye)) < apart;
  }
  // Half a light voxel apart.
  const double step = 0.5 * edgeOf(medium, layout);
  const int n = static_cast<int>(std::ceil(2 * layout.nearEye));
  for (int z = -n; z <= n; ++z)
    for (int y = -n; y <= n; ++y)
      for (int x = -n; x <= n; ++x)
        if (medium.extinction(Vec3f(view.eye + step * Vec3d(x, y, z))) > 0.0f) return true;
  return false;
}

std::uint64_t nearEyeBytes(const Medium& medium, const LightFieldLayout& layout, const View& view) {
  if (!gathersNearEye(medium, layout, view)) return 0;
  const double edge = edgeOf(medium, layout);
  const double across = reachOf(layout, edge) / edge + 1.0;
  const Vec3d box = medium.bounds().extent() / edge + 2.0 * layout.radius / edge + 10.0;
  const double voxels = std::min(4.0 / 3.0 * kPi * across * across * across, box.x * box.y * box.z);
  const LightFieldLayout near = nearLayout(layout);
  // Sums, and the values that they make; later two smoothings of these.
  const double each = sizeof(std::int64_t) + sizeof(float);
  return static_cast<std::uint64_t>(std::min(voxels * each * near.valuesPerCarrier(), 1e18));
}

bool gathersNearEye(const Medium& medium, const LightFieldLayout& layout, const View& view) {
  return layout.basis == Basis::view && !layout.holdsPower() && readsNearEye(medium, layout, view);
}

LightFieldLayout nearLayout(const LightFieldLayout& layout) {
  LightFieldLayout near = layout;
  near.nearEye = 0;
  near.evaluate = Evaluate::perStep;
  near.merge = Merge::full;
  if (near.smoothing != Smoothing::visible) near.smoothing = Smoothing::twicing;
  if (layout.basis == Basis::view) {
    near.basis = Basis::histogram;
    near.carrier = Carrier::voxels;
    near.rows = std::max(kNearRows, layout.rows);
    near.angularKernel = sphere::AngularKernel::none;
  }
  return near;
}

std::vector<std::size_t> voxelsNearEye(const SupportLattice& lattice,
                                       const LightFieldLayout& layout, const View& view) {
  const double reach = reachOf(layout, lattice.edge());
  std::vector<std::size_t> voxels;
  for (std::size_t i = 0; i < lattice.size(); ++i)
    if (glm::length(Vec3d(lattice.center(i)) - view.eye) < reach) voxels.push_back(i);
  return voxels;
}

SupportLattice partOf(const SupportLattice& lattice, const std::vector<std::size_t>& voxels) {
  Vec3i low(std::numeric_limits<int>::max()), high(0);
  for (const std::size_t i : voxels) {
    low = glm::min(low, lattice.voxel(i) >> 3);
    high = glm::max(high, lattice.voxel(i) >> 3);
  }
  std::vector<Vec3i> active;
  active.reserve(voxels.size());
  for (const std::size_t i : voxels)
    active.push_back(lattice.voxel(i) - 8 * low);
  return {lattice.origin() + lattice.edge() * Vec3d(8 * low), lattice.edge(), high - low + 1,
          active};
}

std::optional<LightField> nearField(const Medium& medium, LightField& field, const View& view) {
  std::optional<LightField> near;
  if (field.near) {
    if (field.near.use_count() == 1)
      near = std::move(*field.near);
    else
      near = *field.near;
    near->layout.radius = field.layout.radius;
  } else if (field.layout.basis != Basis::view && readsNearEye(medium, field.layout, view)) {
    near = partNearEye(field, view, edgeOf(medium, field.layout));
  }
  if (near && near->carriers() == 0) near.reset();
  return near;
}

std::unique_ptr<InscatterSource> joinAtEye(std::unique_ptr<InscatterSource> far,
                                           std::unique_ptr<InscatterSource> near, const Vec3f& eye,
                                           double radius) {
  return std::make_unique<JoinedAtEye>(std::move(far), std::move(near), eye, radius);
}

NearEyeSink::NearEyeSink(transport::FlightSink& all, transport::FlightSink& near,
                         const SupportLattice& lattice, const Vec3d& eye)
    : m_all(all), m_near(near), m_eye(eye) {
  double farthest = 0;
  for (std::size_t i = 0; i < lattice.size(); ++i)
    farthest = std::max(farthest, glm::length(Vec3d(lattice.center(i)) - eye));
  m_reach = static_cast<float>(farthest + lattice.edge());
}

void NearEyeSink::consume(std::span<const Flight> flights) {
  m_all.consume(flights);
  static thread_local std::vector<Flight> passing;
  passing.clear();
  for (const Flight& flight : flights) {
    const Vec3f toEye = m_eye - flight.origin;
    const float t = glm::clamp(glm::dot(toEye, flight.direction), 0.0f, flight.length);
    const Vec3f apart = toEye - flight.direction * t;
    if (glm::dot(apart, apart) < m_reach * m_reach) passing.push_back(flight);
  }
  if (!passing.empty()) m_near.consume(passing);
}

}  // namespace photosphere::estimators
