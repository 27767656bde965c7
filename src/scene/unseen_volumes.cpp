#include "unseen_volumes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "blur.h"

namespace photosphere::scene {

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
// More than rounding takes from a length or an angle.
constexpr double kSlack = 1e-6;

double product(double a, double b) {
  return a > 0 && b > 0 ? a * b : 0.0;  // nothing times infinity is nothing
}

Box3d aroundRounding(const Box3d& box) {
  if (box.empty()) return box;
  return volume::widened(box, kSlack * (glm::length(box.extent()) + glm::length(box.center())));
}

// Of all that a volume has, wherever it moves.
Box3d boxOf(const transport::Medium& medium, const transport::MediumVolume& v) {
  if (medium.volumes().size() == 1) return aroundRounding(medium.bounds());
  Box3d box = volume::supportBounds(v.density, v.localFromNode);
  const Box3d glow = volume::supportBounds(v.emission.field, v.emission.localFromNode);
  if (!glow.empty()) {
    box.grow(glow.min);
    box.grow(glow.max);
  }
  return aroundRounding(volume::widened(box, v.motion.reach(medium.shutter())));
}

lights::BoundingSphere sphereOf(const Box3d& box) {
  if (box.empty()) return {Vec3d(0.0), 0.0};
  return {box.center(), 0.5 * glm::length(box.extent()) * (1 + kSlack)};
}

// Farthest from a point that a field has anything but zero [m].
template <class T>
double farthestFrom(const Vec3d& point, const volume::BrickField<T>& field,
                    const Mat4d& localFromNode) {
  const Mat3d linear(localFromNode);
  const double half =
      0.5 * (glm::length(linear[0]) + glm::length(linear[1]) + glm::length(linear[2]));
  double farthest = 0;
  volume::forEachCell(field, [&](const Vec3i& cell, int edge, float) {
    const Vec3d center = transformPoint(localFromNode, Vec3d(cell) + 0.5 * edge);
    farthest = std::max(farthest, glm::length(center - point) + half * edge);
  });
  return farthest;
}

// About the middle of the box, no larger than the volume needs.
lights::BoundingSphere sphereOf(const transport::MediumVolume& v, const Box3d& box, double reach) {
  lights::BoundingSphere sphere = sphereOf(box);
  const double farthest =
      std::max(farthestFrom(sphere.center, v.density, v.localFromNode),
               farthestFrom(sphere.center, v.emission.field, v.emission.localFromNode));
  sphere.radius = std::min(sphere.radius, (farthest + reach) * (1 + kSlack));
  return sphere;
}

double distanceBetween(const Box3d& a, const Box3d& b) {
  return glm::length(glm::max(Vec3d(0.0), glm::max(a.min - b.max, b.min - a.max)));
}

// Solid angle of a sphere from the points of a box, at most [sr].
double solidAngle(const lights::BoundingSphere& sphere, const Box3d& from) {
  const double distance = glm::length(sphere.center - from.nearest(sphere.center));
  if (!(distance > sphere.radius)) return 4 * kPi;
  const double sine = sphere.radius / distance;
  return 2 * kPi * sine * sine / (1 + std::sqrt(1 - sine * sine));
}

double angleBetween(const Vec3d& a, const Vec3d& b) {
  return 2 * std::asin(std::min(1.0, 0.5 * glm::length(a - b)));
}

// Directions of all ways from one sphere to another.
DirectionCone waysBetween(const lights::BoundingSphere& from, const lights::BoundingSphere& to) {
  const Vec3d apart = to.center - from.center;
  const double distance = glm::length(apart), radii = from.radius + to.radius;
  if (!(distance > radii)) return {};
  return {apart / distance, std::asin(radii / distance) + kSlack};
}

DirectionCone coneOf(const lights::Reach& reach) {
  const double half = std::sqrt(glm::clamp(reach.oneMinusCos / 2, 0.0, 1.0));
  return {reach.axis, std::min(kPi, 2 * std::asin(half) + kSlack)};
}

double leastAngle(const DirectionCone& a, const DirectionCone& b) {
  return std::max(0.0, angleBetween(a.axis, b.axis) - a.angle - b.angle);
}

lights::Reach reachOf(double fluence, double radiance, const DirectionCone& cone) {
  const double half = std::sin(0.5 * std::min(kPi, cone.angle));
  return {.fluence = fluence,
          .radiance = radiance,
          .background = 0.0,
          .axis = cone.axis,
          .oneMinusCos = 2 * half * half};
}

// Integral of what is at most this in each voxel cell.
template <class T>
double integral(const volume::BrickField<T>& field, const Mat4d& localFromNode) {
  const double cell = std::abs(glm::determinant(Mat3d(localFromNode)));
  double sum = 0;
  volume::forEachCell(field, [&](const Vec3i&, int edge, float most) {
    sum += static_cast<double>(most) * cell * edge * edge * edge;
  });
  return sum;
}

void add(const SmokeBounds& more, SmokeBounds& sum) {
  for (const phase::PhaseFunction& phase : more.phases)
    if (std::find(sum.phases.begin(), sum.phases.end(), phase) == sum.phases.end())
      sum.phases.push_back(phase);
  sum.depths += more.depths;
  sum.meanDepth += more.meanDepth;
  sum.albedo = std::max(sum.albedo, more.albedo);
  sum.glow += more.glow;
}

// Most that one scattering leaves of light that was scattered there before.
double again(const SmokeBounds& smoke, double mostOfPhase) {
  return smoke.albedo * std::min(opacityOf(smoke.depths.any()),
                                 4 * kPi * mostOfPhase * opacityOf(smoke.meanDepth));
}

double over(double a, double rest) {
  return a > 0 ? (rest > 0 ? a / rest : kInfinite) : 0.0;
}

// min(W a, K / d^2): what reaches from something of opacity a, in units of its radiance.
double spread(double opacity, double angle, double integrated, double distance) {
  return std::min(opacity * angle, over(integrated, distance * distance));
}

}  // namespace

bool isUnseen(const SceneFile& scene, const FrameSetup& setup, const Box3d& box) {
  if (box.empty() || setup.motion) return false;
  const std::vector<glm::dvec4> planes =
      seenPlanes(scene, setup, {Vec2i(0), setup.camera->resolution()});
  // At a distance z a ray through the lens is off the one through its middle by its radius times
  // |1 - z / focus|.
  double margin = 0;
  if (setup.lens.radius > 0) {
    const Vec3d eye = setup.space.localFromWorld(setup.camera->position());
    const double focus = setup.lens.focusDistance * setup.space.metersPerUnit;
    double farthest = 0;
    for (int corner = 0; corner < 8; ++corner)
      farthest =
          std::max(farthest, glm::dot(box.corner(corner) - eye, setup.camera->viewDirection()));
    margin = setup.lens.radius * setup.space.metersPerUnit *
             std::max(1.0, std::abs(1 - farthest / focus));
  }
  return std::any_of(planes.begin(), planes.end(), [&](const glm::dvec4& plane) {
    for (int corner = 0; corner < 8; ++corner)
      if (!(glm::dot(plane, glm::dvec4(box.corner(corner), 1.0)) < -margin)) return false;
    return true;
  });
}

Box3d worldBoundsOf(const transport::Medium& medium, const lights::LocalSpace& space) {
  Box3d world;
  if (const Box3d& local = medium.bounds(); !local.empty()) {
    world.grow(space.worldFromLocal(local.min));
    world.grow(space.worldFromLocal(local.max));
  }
  return world;
}

void leaveOut(const std::vector<bool>& out, FrameSetup& setup) {
  const transport::Shutter shutter = setup.medium->shutter();
  std::vector<transport::MediumVolume> volumes = std::move(*setup.medium).takeVolumes(), kept;
  for (std::size_t i = 0; i < volumes.size(); ++i)
    if (!out[i]) kept.push_back(std::move(volumes[i]));
  setup.medium = std::make_unique<transport::Medium>(std::move(kept), shutter);
  setup.worldBounds = worldBoundsOf(*setup.medium, setup.space);
}

UnseenVolumes::UnseenVolumes(const SceneFile& scene, const FrameSetup& setup,
                             const DirectionCone& view)
    : m_view(view) {
  const transport::Medium& medium = *setup.medium;
  bool any = false;
  for (const transport::MediumVolume& v : medium.volumes()) {
    m_unseen.push_back(isUnseen(scene, setup, boxOf(medium, v)));
    any = any || m_unseen.back();
  }
  if (!any) return;
  for (const transport::MediumVolume& v : medium.volumes())
    m_parts.push_back(makePart(medium, v, setup.lights));
  m_scattered = scattered();
}

UnseenVolumes::Part UnseenVolumes::makePart(const transport::Medium& medium,
                                            const transport::MediumVolume& v,
                                            const transport::LightList& lights) {
  Part part;
  part.box = boxOf(medium, v);
  const double reach = v.motion.reach(medium.shutter());
  part.smoke.sphere = sphereOf(v, part.box, reach);
  part.smoke.phases = {v.phase};
  part.smoke.albedo =
      static_cast<double>(v.albedoFields.empty() ? glm::clamp(maxComponent(v.albedo), 0.0f, 1.0f)
                                                 : medium.maximumAlbedo());
  const bool moves = reach > 0;
  const volume::MajorantSource source{&v.density, v.localFromNode, v.densityScale, reach};
  const volume::MajorantGrid majorants({&source, 1});
  part.smoke.depths = DepthBound(majorants);
  part.smoke.meanDepth = largestMeanDepth(v, majorants, moves);
  const Vec3d extent = part.box.empty() ? Vec3d(0.0) : part.box.extent();
  const double most = brightestEmission(v), volume = extent.x * extent.y * extent.z;
  part.smoke.glow = most * glm::length(extent);
  // Motion may spread out what is densest.
  part.extinction = moves ? static_cast<double>(majorants.maximum()) * volume
                          : v.densityScale * integral(v.density, v.localFromNode);
  part.power = moves ? most * volume : integral(v.emission.field, v.emission.localFromNode);
  for (const auto& light : lights)
    part.lamps.push_back(light->reach(part.smoke.sphere));
  return part;
}

// M of the header.
double UnseenVolumes::scattered() const {
  SmokeBounds all;
  for (const Part& part : m_parts)
    add(part.smoke, all);
  const double most = PhaseEnvelope(all.phases).maximum();
  const double left = 1 - again(all, most);
  double source = over(all.glow, left);
  for (std::size_t l = 0; l < m_parts.front().lamps.size(); ++l) {
    double fluence = 0, radiance = 0;
    for (const Part& part : m_parts) {
      fluence = std::max(fluence, part.lamps[l].fluence);
      radiance = std::max(radiance, part.lamps[l].radiance);
    }
    source += fluence > 0 ? std::min(radiance, over(product(most, fluence), left)) : 0.0;
  }
  return product(all.albedo * opacityOf(all.depths.any()), source) + all.glow;
}

UnseenVolumes::Rest UnseenVolumes::restWithout(const std::vector<bool>& out,
                                               const transport::LightList& lights) const {
  Rest rest;
  for (std::size_t i = 0; i < m_parts.size(); ++i) {
    if (out[i] || m_parts[i].box.empty()) continue;
    rest.parts.push_back(&m_parts[i]);
    rest.box.grow(m_parts[i].box.min);
    rest.box.grow(m_parts[i].box.max);
    add(m_parts[i].smoke, rest.smoke);
  }
  rest.smoke.sphere = sphereOf(rest.box);
  double needed = 0;
  for (const Part* r : rest.parts)
    needed = std::max(needed, glm::length(r->smoke.sphere.center - rest.smoke.sphere.center) +
                                  r->smoke.sphere.radius);
  rest.smoke.sphere.radius = std::min(rest.smoke.sphere.radius, needed * (1 + kSlack));
  for (const auto& light : lights)
    rest.lamps.push_back(light->reach(rest.smoke.sphere));
  return rest;
}

std::vector<double> UnseenVolumes::effects(const std::vector<bool>& out,
                                           const transport::LightList& lights,
                                           bool multiple) const {
  std::vector<double> effects(m_unseen.size(), 0.0);
  if (m_parts.empty()) return effects;
  const Rest rest = restWithout(out, lights);
  if (rest.parts.empty()) return effects;  // the picture shows no smoke
  const LightBounds bounds(rest.smoke, m_view);
  for (std::size_t i = 0; i < m_parts.size(); ++i)
    if (out[i])
      effects[i] = std::max(multiple ? adds(m_parts[i], rest, bounds) : 0.0,
                            takes(m_parts[i], rest, bounds, multiple));
  return effects;
}

// S of the header.
double UnseenVolumes::lightScatteredIn(const Part& part, const DirectionCone& toRest) const {
  const PhaseEnvelope phase(part.smoke.phases);
  double toward = 0, any = 0;
  for (const lights::Reach& lamp : part.lamps) {
    const double apart = leastAngle(coneOf(lamp), toRest);
    if (!(lamp.fluence > 0)) continue;
    toward += std::min(lamp.radiance, product(lamp.fluence, phase.beyond(apart)));
    any += std::min(lamp.radiance, product(lamp.fluence, phase.maximum()));
  }
  double angle = 0;
  for (const Part& other : m_parts)
    if (&other != &part && !other.box.empty()) angle += solidAngle(other.smoke.sphere, part.box);
  const double rest = product(std::min(1.0, phase.maximum() * angle), m_scattered);
  const double p = again(part.smoke, phase.maximum()), glow = part.smoke.glow;
  return std::min(toward + rest + glow + product(p, over(any + rest + glow, 1 - p)),
                  any + m_scattered);
}

// P of the header.
double UnseenVolumes::adds(const Part& part, const Rest& rest, const LightBounds& bounds) const {
  const DirectionCone toRest = waysBetween(part.smoke.sphere, rest.smoke.sphere);
  const double opacity = opacityOf(part.smoke.depths.within(toRest));
  double scattering = 0, glow = 0;
  for (const Part* r : rest.parts) {
    const double angle = solidAngle(part.smoke.sphere, r->box);
    const double distance = distanceBetween(part.box, r->box);
    scattering = std::max(scattering, spread(opacity, angle, part.extinction, distance));
    glow = std::max(
        glow, std::min(product(part.smoke.glow, angle), over(part.power, distance * distance)));
  }
  const double source = product(part.smoke.albedo, lightScatteredIn(part, toRest));
  const LampBound bound = bounds.of(reachOf(product(source, scattering) + glow,
                                            product(source, opacity) + part.smoke.glow, toRest));
  return bound.single + bound.multiple;
}

// N of the header.
double UnseenVolumes::takes(const Part& part, const Rest& rest, const LightBounds& bounds,
                            bool multiple) const {
  double sum = 0;
  const auto take = [&](double fluence, double radiance, const DirectionCone& cone) {
    const LampBound bound = bounds.of(reachOf(fluence, radiance, cone));
    sum += bound.single + (multiple ? bound.multiple : 0.0);
  };
  for (std::size_t l = 0; l < part.lamps.size(); ++l) {
    if (!(part.lamps[l].fluence > 0)) continue;
    double fluence = 0, opacity = 0;
    for (const Part* r : rest.parts) {
      const lights::Reach& here = r->lamps[l];
      const DirectionCone ways = waysBetween(part.smoke.sphere, r->smoke.sphere);
      if (leastAngle(ways, coneOf(here)) > 0 || leastAngle(ways, coneOf(part.lamps[l])) > 0)
        continue;
      const double a = opacityOf(part.smoke.depths.within(coneOf(here)));
      opacity = std::max(opacity, a);
      fluence = std::max(
          fluence, std::min(product(here.fluence, a),
                            product(here.radiance,
                                    spread(a, solidAngle(part.smoke.sphere, r->box),
                                           part.extinction, distanceBetween(part.box, r->box)))));
    }
    take(fluence, product(opacity, rest.lamps[l].radiance), coneOf(rest.lamps[l]));
  }
  if (!multiple || distanceBetween(part.box, rest.box) > 0) return sum;
  const double opacity = opacityOf(part.smoke.depths.any());
  double between = 0;
  for (const Part* r : rest.parts)
    between = std::max(between, spread(opacity, solidAngle(part.smoke.sphere, r->box),
                                       part.extinction, distanceBetween(part.box, r->box)));
  take(product(m_scattered, between), product(m_scattered, opacity), {});
  return sum;
}

}  // namespace photosphere::scene
