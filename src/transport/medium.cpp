#include "photosphere/transport/medium.h"

#include <fmt/format.h>

#include "albedo_range.h"
#include "photosphere/core/error.h"
#include "photosphere/core/hash.h"

namespace photosphere::transport {

namespace {

template <class T>
void hashField(Hasher& hasher, const volume::BrickField<T>& field, const Mat4d& placement) {
  hasher.numbers(&placement[0][0], 16);
  const Vec3i& bricks = field.bricks();
  hasher.numbers(&bricks.x, 3);
  for (int z = 0; z < bricks.z; ++z)
    for (int y = 0; y < bricks.y; ++y)
      for (int x = 0; x < bricks.x; ++x) {
        const std::int32_t brick = field.brickAt({x, y, z});
        if (brick < 0) continue;
        const Vec3i at(x, y, z);
        hasher.numbers(&at.x, 3);
        constexpr std::size_t kNumbers =
            volume::BrickField<T>::kBrickSize * sizeof(T) / sizeof(float);
        hasher.numbers(reinterpret_cast<const float*>(field.nodes(brick)), kNumbers);
      }
}

// One Henyey-Greenstein lobe hashes as it did when there was nothing else.
void hashPhase(Hasher& hasher, const phase::PhaseFunction& phase) {
  for (int i = 0; i < phase.lobes(); ++i) {
    hasher.number(phase.lobe(i).g());
    if (phase.plain()) continue;
    hasher.number(phase.lobe(i).alpha());
    hasher.number(phase.weight(i));
  }
}

bool isGrey(const Rgb& c) {
  return c.x == c.y && c.y == c.z;
}

// Nodes along each axis in a metre of any direction, summed over the axes.
float steepnessOf(const Mat4d& localFromNode) {
  const Mat3d nodes = glm::transpose(glm::inverse(Mat3d(localFromNode)));
  return static_cast<float>(glm::length(nodes[0]) + glm::length(nodes[1]) + glm::length(nodes[2]));
}

}  // namespace

Medium::Placed Medium::place(const volume::BrickField<float>& field, const Mat4d& localFromNode,
                             double scale, int phaseIndex) {
  return {&field, volume::NodeFromLocal(localFromNode), static_cast<float>(scale), phaseIndex};
}

Medium::Medium(std::vector<MediumVolume> volumes, const Shutter& shutter)
    : m_volumes(std::move(volumes)), m_shutter(shutter) {
  std::vector<volume::MajorantSource> sources;
  double edge = std::numeric_limits<double>::infinity();
  double glowReach = 0.0;
  Hasher hasher;
  std::vector<const VolumeEmission*> emitting;
  for (const MediumVolume& v : m_volumes) {
    const double reach = v.motion.reach(shutter);
    m_displacement = std::max(m_displacement, reach);
    m_motions.push_back(
        {reach > 0 ? &v.motion.velocity : nullptr, volume::NodeFromLocal(v.motion.localFromNode)});
    sources.push_back({&v.density, v.localFromNode, v.densityScale, reach});
    if (!v.density.empty()) {
      edge = std::min(edge, volume::finestSpacing(v.localFromNode));
      m_steepness = std::max(m_steepness, steepnessOf(v.localFromNode));
    }
    if (!v.emission.field.empty()) {
      m_emitting.push_back(m_placed.size());
      emitting.push_back(&v.emission);
      glowReach = std::max(glowReach, reach);
    }
    int phaseIndex = 0;
    while (phaseIndex < static_cast<int>(m_phases.size()) &&
           !(m_phases[static_cast<std::size_t>(phaseIndex)] == v.phase))
      ++phaseIndex;
    if (phaseIndex == static_cast<int>(m_phases.size())) m_phases.push_back(v.phase);
    m_placed.push_back(place(v.density, v.localFromNode, v.densityScale, phaseIndex));

    Albedo albedo;
    albedo.constant = v.albedo;
    for (const auto& field : v.albedoFields)
      albedo.fields.push_back(place(field, v.localFromAlbedoNode, 1.0, 0));
    m_grey = m_grey && (albedo.fields.empty() ? photosphere::transport::isGrey(v.albedo)
                                              : albedo.fields.size() == 1);
    m_maximumAlbedo = std::max(m_maximumAlbedo, largestAlbedo(v));
    m_albedo.push_back(std::move(albedo));
    hashVolume(hasher, v);
  }
  if (m_phases.size() > static_cast<std::size_t>(kMaxPhases))
    throw ConfigError(
        fmt::format("the volumes mix {} different phase functions; at most {} are served",
                    m_phases.size(), kMaxPhases));
  m_moving = m_displacement > 0;
  findColours();
  m_uniformAlbedo = m_volumes.size() == 1 && m_albedo.front().fields.empty() && !m_coloured;
  if (m_phases.empty()) m_phases.emplace_back();
  if (!emitting.empty()) {
    m_emission = std::make_unique<Emission>(emitting, glowReach);
    m_emission->hash(hasher);
  }
  const volume::WalkedRegion glow = m_emission ? m_emission->region() : volume::WalkedRegion{};
  if (!std::isfinite(edge)) edge = glow.spacing;
  if (std::isfinite(edge)) m_voxelEdge = edge;
  m_majorants = volume::MajorantGrid(sources, glow);
  if (m_emission) m_emission->markCells(m_majorants);
  m_hash = hasher.hex();
}

Medium Medium::held() && {
  for (MediumVolume& v : m_volumes)
    v.motion = {};
  return Medium(std::move(m_volumes));
}

// What rests and is grey hashes as it did when there was nothing else.
void Medium::hashVolume(Hasher& hasher, const MediumVolume& v) const {
  hasher.number(v.densityScale);
  if (v.tint != Rgb(1.0f)) hasher.numbers(&v.tint.x, 3);
  hasher.numbers(&v.albedo.x, 3);
  hashPhase(hasher, v.phase);
  hashField(hasher, v.density, v.localFromNode);
  for (const auto& field : v.albedoFields)
    hashField(hasher, field, v.localFromAlbedoNode);
  if (!m_motions.back().velocity) return;
  hasher.number(m_shutter.open);
  hasher.number(m_shutter.close);
  hashField(hasher, v.motion.velocity, v.motion.localFromNode);
}

void Medium::findColours() {
  const MediumVolume* first = nullptr;
  bool shared = true;
  Rgb densest(0.0f);
  for (const MediumVolume& v : m_volumes) {
    if (v.density.empty() || !(v.densityScale > 0)) continue;
    if (!first) first = &v;
    shared = shared && v.tint == first->tint;
    densest = glm::max(densest, v.tint);
    m_coloured = m_coloured || !photosphere::transport::isGrey(v.tint);
  }
  if (shared) m_tint = first ? first->tint : Rgb(1.0f);
  // Rarer collisions cost less and tell less each: where a walk would be no more than so many times
  // as long they are kept.
  constexpr float kWorthwhile = 0.25f;
  if (first) m_densest = glm::mix(densest, Rgb(1.0f), glm::greaterThan(densest, Rgb(kWorthwhile)));
  m_grey = m_grey && !m_coloured;
}

float Medium::extinction(const Vec3f& p, Moment when) const {
  float sum = 0.0f;
  for (std::size_t i = 0; i < m_placed.size(); ++i)
    sum +=
        m_placed[i].scale * m_placed[i].field->sample(m_placed[i].nodeFromLocal(rest(i, p, when)));
  return sum;
}

float Medium::extinction(const Vec3f& p, Moment when, Vec3f& carrier) const {
  if (m_placed.size() == 1) {
    const Placed& only = m_placed.front();
    carrier = rest(0, p, when);
    return only.scale * only.field->sample(only.nodeFromLocal(carrier));
  }
  Vec3f sum(0.0f);
  float extinction = 0.0f, weights = 0.0f;
  for (std::size_t i = 0; i < m_placed.size(); ++i) {
    const Vec3f at = rest(i, p, when);
    const Placed& v = m_placed[i];
    const float density = v.field->sample(v.nodeFromLocal(at));
    // Where there is no smoke, what is stored is not read: any place between theirs will do.
    const float weight = v.scale * (density + 1e-6f);
    extinction += v.scale * density;
    sum += weight * at;
    weights += weight;
  }
  carrier = weights > 0.0f ? sum / weights : p;
  return extinction;
}

template <class When>
Rgb Medium::channelSum(const Vec3f& p, When when) const {
  Rgb sum(0.0f);
  for (std::size_t i = 0; i < m_placed.size(); ++i)
    sum += m_volumes[i].tint *
           (m_placed[i].scale *
            m_placed[i].field->sample(m_placed[i].nodeFromLocal(rest(i, p, when))));
  return sum;
}

template Rgb Medium::channelSum(const Vec3f&, Still) const;
template Rgb Medium::channelSum(const Vec3f&, Moment) const;

Vec3f Medium::carrierOf(const Vec3f& p, Moment when) const {
  if (m_placed.size() == 1) return rest(0, p, when);
  Vec3f carrier;
  extinction(p, when, carrier);
  return carrier;
}

Rgb Medium::emitted(const Vec3f& p, Moment when) const {
  Rgb sum(0.0f);
  for (std::size_t i = 0; i < m_emitting.size(); ++i)
    sum += m_emission->part(i, rest(m_emitting[i], p, when));
  return sum;
}

Rgb Medium::Albedo::at(const Vec3f& p) const {
  if (fields.empty()) return constant;
  Rgb value(fields[0].field->sample(fields[0].nodeFromLocal(p)));
  for (std::size_t c = 1; c < fields.size() && c < 3; ++c)
    value[static_cast<int>(c)] = fields[c].field->sample(fields[c].nodeFromLocal(p));
  return glm::clamp(value, 0.0f, 1.0f);
}

template <class When>
void Medium::gather(const Vec3f& p, Coefficients& out, When when) const {
  out.extinction = 0.0f;
  for (std::size_t i = 0; i < m_phases.size(); ++i)
    out.scattering[i] = Rgb(0.0f);
  for (std::size_t i = 0; i < m_placed.size(); ++i) {
    const Placed& v = m_placed[i];
    const Vec3f at = rest(i, p, when);
    const float sigma = v.scale * v.field->sample(v.nodeFromLocal(at));
    if (!(sigma > 0.0f)) continue;
    out.extinction += sigma;
    const Rgb albedo = m_coloured ? m_volumes[i].tint * m_albedo[i].at(at) : m_albedo[i].at(at);
    out.scattering[static_cast<std::size_t>(v.phaseIndex)] += sigma * albedo;
  }
}

void Medium::coefficients(const Vec3f& p, Coefficients& out, Still when) const {
  gather(p, out, when);
}

void Medium::coefficients(const Vec3f& p, Coefficients& out, Moment when) const {
  gather(p, out, when);
}

std::uint64_t Medium::memoryBytes() const {
  std::uint64_t bytes = m_majorants.memoryBytes() + (m_emission ? m_emission->memoryBytes() : 0);
  for (const MediumVolume& v : m_volumes) {
    bytes += v.density.memoryBytes();
    bytes += v.motion.velocity.memoryBytes();
    for (const auto& field : v.albedoFields)
      bytes += field.memoryBytes();
  }
  return bytes;
}

bool clip(const Box3d& box, const Vec3d& origin, const Vec3d& direction, double& t0, double& t1) {
  if (box.empty()) return false;
  for (int a = 0; a < 3; ++a) {
    if (direction[a] == 0.0) {
      if (origin[a] < box.min[a] || origin[a] > box.max[a]) return false;
      continue;
    }
    double near = (box.min[a] - origin[a]) / direction[a];
    double far = (box.max[a] - origin[a]) / direction[a];
    if (near > far) std::swap(near, far);
    t0 = std::max(t0, near);
    t1 = std::min(t1, far);
  }
  return t0 < t1;
}

}  // namespace photosphere::transport
