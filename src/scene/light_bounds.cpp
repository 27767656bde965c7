#include "light_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "photosphere/transport/photon_tracer.h"

namespace photosphere::scene {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Opacity from which on it is not worth looking at every voxel: nothing will be left out.
constexpr double kThick = 0.95;

double angleBetween(const Vec3d& a, const Vec3d& b) {
  return 2 * std::asin(std::min(1.0, 0.5 * glm::length(a - b)));
}

double angleOf(double oneMinusCos) {
  return 2 * std::asin(std::sqrt(glm::clamp(oneMinusCos / 2, 0.0, 1.0)));
}

// Most of a lobe between two angles that lie on one side of a right angle: both factors are
// monotonous there.
double largestBetween(const phase::Draine& lobe, double from, double to) {
  const double g = lobe.g(), alpha = lobe.alpha();
  const auto henyeyGreenstein = [&](double angle) {
    const double s = std::sin(0.5 * angle), d = (1 - g) * (1 - g) + 4 * g * s * s;
    return (1 - g * g) / (4 * kPi * d * std::sqrt(d));
  };
  const auto draine = [&](double angle) { return 1 + alpha * std::cos(angle) * std::cos(angle); };
  return std::max(henyeyGreenstein(from), henyeyGreenstein(to)) *
         std::max(draine(from), draine(to)) / (1 + alpha * (1 + 2 * g * g) / 3);
}

double largestBetween(const phase::PhaseFunction& phase, double from, double to) {
  double sum = 0;
  for (int i = 0; i < phase.lobes(); ++i)
    sum += phase.weight(i) * largestBetween(phase.lobe(i), from, to);
  return sum;
}

double product(double a, double b) {
  return a > 0 && b > 0 ? a * b : 0.0;  // nothing times infinity is nothing
}

}  // namespace

PhaseEnvelope::PhaseEnvelope(const std::vector<phase::PhaseFunction>& phases) {
  double integral = 0;
  for (int i = 0; i < kBins; ++i) {
    const double from = kPi * i / kBins, to = kPi * (i + 1) / kBins;
    double& most = m_beyond[static_cast<std::size_t>(i)];
    for (const phase::PhaseFunction& phase : phases)
      most = std::max(most, largestBetween(phase, from, to));
    integral += most * 2 * kPi * (std::cos(from) - std::cos(to));
  }
  if (phases.size() > 1)
    m_norm = std::max(1.0, std::min(integral, static_cast<double>(phases.size())));
  for (std::size_t i = kBins - 1; i-- > 0;)
    m_beyond[i] = std::max(m_beyond[i], m_beyond[i + 1]);
}

double PhaseEnvelope::beyond(double angle) const {
  const int bin = static_cast<int>(std::max(0.0, angle) / kPi * kBins);
  return m_beyond[static_cast<std::size_t>(std::min(bin, kBins - 1))];
}

double PhaseEnvelope::widenedNorm(double angle) const {
  if (!(angle > 0)) return m_norm;
  double integral = 0;
  for (int i = 0; i < kBins; ++i) {
    const double from = kPi * i / kBins, to = kPi * (i + 1) / kBins;
    integral += beyond(from - angle) * 2 * kPi * (std::cos(from) - std::cos(to));
  }
  return std::max(m_norm, std::min(integral, 4 * kPi * maximum()));
}

DepthBound::DepthBound(const volume::MajorantGrid& majorants) {
  if (majorants.size() == 0) return;
  const Vec3i& dims = majorants.dims();
  std::array<std::vector<float>, 3> most;
  for (int a = 0; a < 3; ++a)
    most[static_cast<std::size_t>(a)].resize(static_cast<std::size_t>(dims[a]));
  for (int z = 0; z < dims.z; ++z)
    for (int y = 0; y < dims.y; ++y)
      for (int x = 0; x < dims.x; ++x) {
        const float m = majorants.majorant({x, y, z});
        float& layerX = most[0][static_cast<std::size_t>(x)];
        float& layerY = most[1][static_cast<std::size_t>(y)];
        float& layerZ = most[2][static_cast<std::size_t>(z)];
        layerX = std::max(layerX, m);
        layerY = std::max(layerY, m);
        layerZ = std::max(layerZ, m);
      }
  for (int a = 0; a < 3; ++a)
    for (const float m : most[static_cast<std::size_t>(a)])
      m_layers[a] += static_cast<double>(m * majorants.cellSize()[a]);
}

// Every direction has a component of 1 / sqrt(3) or more.
double DepthBound::any() const {
  return std::sqrt(3.0) * maxComponent(m_layers);
}

double DepthBound::within(const DirectionCone& cone) const {
  double least = any();
  for (int a = 0; a < 3; ++a) {
    const double angle = std::acos(std::min(1.0, std::abs(cone.axis[a]))) + cone.angle;
    if (angle < 0.5 * kPi) least = std::min(least, m_layers[a] / std::cos(angle));
  }
  return least;
}

namespace {

// Volume of the smoke by its extinction [m^3], in steps of an eighth of an octave.
class Shells {
 public:
  void add(double sigma, double volume) {
    if (sigma > 0) m_volumes[static_cast<int>(std::floor(8 * std::log2(sigma)))] += volume;
  }
  // Through the ball that it fills, thinner outward, from its middle.
  double depth() const {
    double sum = 0, filled = 0, inner = 0;
    for (auto step = m_volumes.rbegin(); step != m_volumes.rend(); ++step) {
      filled += step->second;
      const double outer = std::cbrt(filled * 3 / (4 * kPi));
      sum += std::exp2((step->first + 1) / 8.0) * (outer - inner);
      inner = outer;
    }
    return sum;
  }

 private:
  std::map<int, double> m_volumes;
};

}  // namespace

double opacityOf(double depth) {
  return -std::expm1(-depth);
}

double brightestEmission(const transport::MediumVolume& volume) {
  float most = 0;
  volume::forEachNode(volume.emission.field, [&](const Vec4f& j) { most = std::max(most, j.w); });
  return static_cast<double>(most);
}

double largestMeanDepth(const transport::MediumVolume& v, const volume::MajorantGrid& majorants,
                        bool moves) {
  Shells shells;
  if (moves) {
    // Motion may draw smoke together: what holds at every time are the majorants.
    const Vec3d size(majorants.cellSize());
    for (int z = 0; z < majorants.dims().z; ++z)
      for (int y = 0; y < majorants.dims().y; ++y)
        for (int x = 0; x < majorants.dims().x; ++x)
          shells.add(static_cast<double>(majorants.majorant({x, y, z})), size.x * size.y * size.z);
  } else {
    const double cell = std::abs(glm::determinant(Mat3d(v.localFromNode)));
    volume::forEachCell(v.density, [&](const Vec3i&, int edge, float most) {
      shells.add(v.densityScale * static_cast<double>(most), cell * edge * edge * edge);
    });
  }
  return shells.depth();
}

namespace {

// In a medium that moves, the majorants are those of all volumes: one stands for all.
double sumOfMeanDepths(const transport::Medium& medium) {
  double depth = 0;
  for (const transport::MediumVolume& v : medium.volumes()) {
    depth += largestMeanDepth(v, medium.majorants(), medium.isMoving());
    if (medium.isMoving()) break;
  }
  return depth;
}

}  // namespace

SmokeBounds smokeBounds(const transport::Medium& medium) {
  SmokeBounds smoke;
  smoke.phases = medium.phases();
  smoke.depths = DepthBound(medium.majorants());
  smoke.meanDepth = opacityOf(smoke.depths.any()) < kThick ? sumOfMeanDepths(medium) : kInfinite;
  smoke.albedo = static_cast<double>(medium.maximumAlbedo());
  smoke.sphere = transport::boundingSphere(medium);
  if (const transport::Emission* emission = medium.emission()) {
    double brightest = 0;
    for (const transport::MediumVolume& v : medium.volumes())
      brightest += brightestEmission(v);
    smoke.glow = brightest * glm::length(emission->region().box.extent());
  }
  return smoke;
}

LightBounds::LightBounds(const SmokeBounds& smoke, const DirectionCone& view)
    : m_phase(smoke.phases),
      m_depths(smoke.depths),
      m_view(view),
      m_sphere(smoke.sphere),
      m_albedo(smoke.albedo),
      m_anyOpacity(opacityOf(m_depths.any())),
      m_behind(4 * kPi * opacityOf(smoke.meanDepth)),
      m_opacity(m_albedo * opacityOf(m_depths.within(view))),
      m_rho(m_albedo * std::min(m_anyOpacity, m_phase.maximum() * m_behind)),
      m_glow(smoke.glow) {}

double LightBounds::scatteredGlow() const {
  const double all = product(m_opacity, m_glow);
  return all > 0 ? (m_rho < 1 ? all / (1 - m_rho) : kInfinite) : 0.0;
}

// S1 of the header. @param apart  the x of the header
double LightBounds::scatteredAgain(const lights::Reach& reach, double alpha, double apart) const {
  const double half = m_phase.beyond(0.5 * apart - alpha), most = m_phase.maximum();
  const double inFront =
      m_anyOpacity *
      std::min(m_phase.beyond(0.5 * apart) * m_phase.widenedNorm(alpha) + half * m_phase.norm(),
               most);
  const double behind = m_behind * most * half;
  return std::min(product(m_albedo * std::min(inFront, behind), reach.fluence),
                  product(m_rho, reach.radiance));
}

LampBound LightBounds::of(const lights::Reach& reach) const {
  LampBound bound;
  bound.background = reach.background;
  if (!(reach.fluence > 0)) return bound;
  const double alpha = angleOf(reach.oneMinusCos);
  const double apart = std::max(0.0, angleBetween(reach.axis, m_view.axis) - m_view.angle);
  bound.single = std::min(product(m_opacity, reach.radiance),
                          product(m_opacity * m_phase.beyond(apart - alpha), reach.fluence));
  const double toward = product(m_opacity, scatteredAgain(reach, alpha, apart));
  const double around = product(m_opacity, scatteredAgain(reach, alpha, 0.0));
  bound.multiple =
      around > 0 ? (m_rho < 1 ? toward + around * m_rho / (1 - m_rho) : kInfinite) : toward;
  bound.multiple = std::min(bound.multiple, product(m_opacity, reach.radiance));
  bound.shadow = opacityOf(m_depths.within({reach.axis, alpha}));
  return bound;
}

}  // namespace photosphere::scene
