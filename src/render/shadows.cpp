#include "photosphere/render/shadows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "instances.h"
#include "lamp_choice.h"
#include "light_depth.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/log.h"
#include "photosphere/core/resources.h"

namespace photosphere::render {

using transport::Medium;
using transport::Segment;
using Field = volume::BrickField<float>;

namespace {

float attenuated(float depth) {
  return fastExp(-depth);
}
Rgb attenuated(const Rgb& depth) {
  return {fastExp(-depth.x), fastExp(-depth.y), fastExp(-depth.z)};
}

// True when one of the eight voxels around a node holds smoke.
bool besideSmoke(const transport::SupportLattice& lattice, const Vec3i& node) {
  for (int corner = 0; corner < 8; ++corner)
    if (lattice.number(node - Vec3i(corner & 1, corner >> 1 & 1, corner >> 2)) >= 0) return true;
  return false;
}

// Times of the shutter at which grids are made: about one for each voxel that the smoke moves.
constexpr double kMostTimes = 9;

// Optical depth of a voxel from where on its own shadow is lost between the nodes of a grid, and
// the share of the smoke's cells that may hold such voxels. Measured on a column of smoke: a
// fiftieth of them loses 2 % of the light scattered once, three fifths 6 %, two thirds 10 %;
// tracking costs 2 to 10 times the march.
constexpr double kThickVoxel = 2;
constexpr double kThickShare = 0.2;
// Of what rays from the camera end in: from outside, a quarter of it loses 2 %; an eye within thick
// smoke, which sees nothing else, 25 %.
constexpr double kThickSeen = 0.5;

// The parts of the camera's rays that lie in the smoke.
std::vector<Segment> partsInside(const Medium& medium, const ShadowUse& use) {
  std::vector<Segment> parts;
  for (const cameras::CameraRay& ray : use.seen)
    parts.push_back(transport::clipToMedium(medium, ray.origin, Vec3f(ray.direction),
                                            std::numeric_limits<double>::infinity()));
  return parts;
}

// The same share of what rays from the camera end in: an eye inside thick smoke sees little else.
double thickShare(const Medium& medium, const std::vector<Segment>& rays) {
  const auto thick = static_cast<float>(kThickVoxel / medium.voxelEdge());
  double all = 0, inThick = 0;
  for (const Segment& inside : rays) {
    float through = 1.0f;
    for (volume::MajorantGrid::Walk walk(medium.majorants(), inside.origin, inside.direction, 0.0f,
                                         inside.length);
         !walk.done() && through > 0.01f; walk.advance()) {
      if (!(walk.majorant() > 0.0f)) continue;
      const float length = walk.end() - walk.begin();
      const Vec3f middle = inside.origin + inside.direction * (walk.begin() + 0.5f * length);
      const float before =
          std::exchange(through, through * attenuated(length * medium.extinction(middle)));
      all += static_cast<double>(before - through);
      if (walk.majorant() > thick) inThick += static_cast<double>(before - through);
    }
  }
  return all > 0 ? inThick / all : 0;
}

// Steps from a place in the smoke to a lamp: through half the box.
double stepsToLamp(const Medium& medium, float step) {
  return 0.5 * glm::length(medium.bounds().extent()) / static_cast<double>(step);
}

// Lookups of extinction that the rays of a frame take to march their shadows: a step at a time, and
// from each as far again to the lamp.
double marchedLookups(const Medium& medium, const std::vector<Segment>& some, std::uint64_t rays,
                      float step) {
  double steps = 0;
  for (const Segment& inside : some)
    steps += static_cast<double>(inside.length / step);
  steps /= static_cast<double>(std::max<std::size_t>(1, some.size()));
  return static_cast<double>(rays) * steps * stepsToLamp(medium, step);
}

// Smoke so few voxels across, in the mean of three directions, has no room for a grid of them: one
// of four voxels loses 1 to 3 % of the light scattered once. Rays to the lamps are as short, and
// marched.
constexpr double kFewVoxels = 10;
bool isSmall(const Medium& medium) {
  const Vec3d size = medium.bounds().extent() / medium.voxelEdge();
  return std::cbrt(size.x * size.y * size.z) < kFewVoxels;
}

}  // namespace

Shadows::Shadows(const Medium& medium, const transport::LightList& lights, ShadowMode mode,
                 float step, std::uint64_t budgetBytes, const ShadowUse& use)
    : m_medium(&medium), m_mode(mode), m_step(step), m_tabulated(lights.size()) {
  if (mode != ShadowMode::grid || medium.bounds().empty()) return;
  const double ofAll =
      medium.majorants().shareAbove(static_cast<float>(kThickVoxel / medium.voxelEdge()));
  const std::vector<Segment> seen = partsInside(medium, use);
  const double ofSeen = thickShare(medium, seen);
  if (ofAll > kThickShare || ofSeen > kThickSeen) {
    log::info(
        "{:.0f} % of the smoke{} is thicker than {} optical depths a voxel: no grid holds its "
        "shadows, they are tracked (render.shadow = \"track\")",
        100 * std::max(ofAll, ofSeen), ofSeen > ofAll ? " that is seen" : "", kThickVoxel);
    m_mode = ShadowMode::track;
    return;
  }
  if (isSmall(medium)) {
    m_mode = ShadowMode::march;
    m_step = std::min(step, 0.5f * static_cast<float>(medium.voxelEdge()));
    return;
  }
  const auto delta = static_cast<std::size_t>(
      std::count_if(lights.begin(), lights.end(), [](const auto& l) { return l->isDelta(); }));
  if (delta > LampChoice::kFew) {
    log::info(
        "{} lamps: a few are drawn for each point, and their shadows are marched "
        "(render.shadow = \"march\")",
        delta);
    m_mode = ShadowMode::march;
    return;
  }
  if (medium.isMoving()) {
    const transport::Shutter& shutter = medium.shutter();
    const double moves = medium.displacement() / shutter.longest() * (shutter.close - shutter.open);
    m_times = static_cast<std::size_t>(
        std::clamp(std::ceil(moves / medium.voxelEdge()) + 1, 2.0, kMostTimes));
  }
  if (medium.isColoured() && !medium.tint()) m_channels = 3;
  const std::vector<Layer> wanted = layers();
  const double most = use.rays > 0 ? marchedLookups(medium, seen, use.rays, step)
                                   : std::numeric_limits<double>::infinity();
  std::optional<transport::SupportLattice> lattice;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (!lights[i]->isDelta()) continue;
    const std::optional<LightDepth> depth = LightDepth::plan(medium, *lights[i]);
    // A small frame is done sooner than a grid of much smoke, or of many times of the shutter; each
    // node of an upright one is a way to the lamp.
    const double lookups =
        depth ? static_cast<double>(depth->nodes())
              : medium.majorants().cubesInside(medium.voxelEdge()) * stepsToLamp(medium, step);
    if (lookups * static_cast<double>(wanted.size()) > most) continue;
    if (!depth && !lattice) lattice.emplace(medium, medium.voxelEdge(), 0);
    const std::uint64_t bytes = wanted.size() * (depth ? depth->predictedBytes()
                                                       : lattice->activeBricks().size() *
                                                             Field::kBrickSize * sizeof(float));
    if (budgetBytes && memoryBytes() + bytes > budgetBytes) {
      log::warning(
          "light '{}': its shadow grid of {} passes the memory budget; its shadows are marched "
          "instead (render.shadow = \"march\"), which is slower",
          lights[i]->name(), formatBytes(bytes));
      continue;
    }
    for (const Layer& layer : wanted)
      if (depth) {
        m_tabulated[i].depths.push_back(*depth);
        m_tabulated[i].depths.back().fill(medium, step, layer.channel, layer.when);
      } else {
        m_tabulated[i].tables.push_back(uprightTable(*lights[i], *lattice, layer));
      }
  }
}

Shadows::~Shadows() = default;

std::vector<Shadows::Layer> Shadows::layers() const {
  const transport::Shutter& shutter = m_medium->shutter();
  std::vector<Layer> all;
  for (std::size_t t = 0; t < m_times; ++t)
    for (std::size_t c = 0; c < m_channels; ++c) {
      Layer layer;
      if (m_channels > 1) layer.channel = static_cast<int>(c);
      if (m_times > 1)
        layer.when = transport::Moment{static_cast<float>(
            shutter.open + (shutter.close - shutter.open) * static_cast<double>(t) /
                               static_cast<double>(m_times - 1))};
      all.push_back(layer);
    }
  return all;
}

float Shadows::marchedDepth(const Segment& toLight, const Layer& layer) const {
  const auto sum = [&](auto when) {
    if (layer.channel < 0)
      return transport::marchOpticalDepth(*m_medium, toLight.origin, toLight.direction,
                                          toLight.length, m_step, when);
    return transport::marchOpticalDepth<Rgb>(*m_medium, toLight.origin, toLight.direction,
                                             toLight.length, m_step, when)[layer.channel];
  };
  return layer.when ? sum(*layer.when) : sum(transport::Still{});
}

Shadows::Table Shadows::uprightTable(const lights::Light& light,
                                     const transport::SupportLattice& lattice,
                                     const Layer& layer) const {
  const double pitch = lattice.edge();
  auto fetch = [&](const Vec3i& brick, float* depth) {
    bool lit = false;
    for (int z = 0; z < Field::kNodes; ++z)
      for (int y = 0; y < Field::kNodes; ++y) {
        throwIfInterrupted();
        for (int x = 0; x < Field::kNodes; ++x) {
          const Vec3i node = brick * 8 + Vec3i(x, y, z);
          if (!besideSmoke(lattice, node)) {
            *depth++ = 0.0f;  // no lookup in smoke reads this node
            continue;
          }
          const Vec3d p = lattice.origin() + Vec3d(node) * pitch;
          const lights::Illumination in = light.illuminate(Vec3f(p), Vec2f(0.5f));
          lit = lit || maxComponent(in.irradiance) > 0.0f;
          const Segment toLight = transport::clipToMedium(*m_medium, p, -in.direction,
                                                          static_cast<double>(in.distance));
          *depth++ = toLight.length > 0.0f ? marchedDepth(toLight, layer) : 0.0f;
        }
      }
    // No node of this brick sees the lamp, so nothing in it is ever looked up with a weight.
    if (!lit) std::fill_n(depth - Field::kBrickSize, Field::kBrickSize, 0.0f);
  };
  return {Field(Vec3i(0), lattice.bricks(), lattice.activeBricks(), fetch), Vec3f(lattice.origin()),
          static_cast<float>(1.0 / pitch)};
}

template <class Light, class Grids, class When>
Light Shadows::depthIn(const Grids& grids, const Vec3f& p, When when) const {
  // Of one time: one number, that times the colour that all volumes share, or three.
  const auto at = [&](std::size_t time) -> Light {
    const auto* grid = grids.data() + time * m_channels;
    if constexpr (std::is_same_v<Light, float>)
      return grid->at(p);
    else
      return m_channels == 1 ? grid->at(p) * *m_medium->tint()
                             : Rgb(grid[0].at(p), grid[1].at(p), grid[2].at(p));
  };
  if constexpr (std::is_same_v<When, transport::Still>) {
    return at(0);
  } else {
    if (m_times == 1) return at(0);
    const transport::Shutter& shutter = m_medium->shutter();
    const double span = std::max(shutter.close - shutter.open, 1e-30);
    const auto place = static_cast<float>((static_cast<double>(when.seconds) - shutter.open) /
                                          span * static_cast<double>(m_times - 1));
    const auto first = std::min(static_cast<std::size_t>(std::max(place, 0.0f)), m_times - 2);
    const float part = std::clamp(place - static_cast<float>(first), 0.0f, 1.0f);
    return at(first) * (1.0f - part) + at(first + 1) * part;
  }
}

template <class Light, class When>
Light Shadows::transmittance(std::size_t light, const Vec3f& p, const Vec3f& direction,
                             float distance, Rng& rng, transport::TrackingCounters& counters,
                             When when) const {
  // The optical depth is interpolated, not the transmittance: it is linear where smoke is even.
  const Tabulated& grids = m_tabulated[light];
  if (!grids.depths.empty()) return attenuated(depthIn<Light>(grids.depths, p, when));
  if (!grids.tables.empty()) return attenuated(depthIn<Light>(grids.tables, p, when));
  const Segment toLight =
      transport::clipToMedium(*m_medium, Vec3d(p), -direction, static_cast<double>(distance));
  if (!(toLight.length > 0.0f)) return Light(1.0f);
  if (m_mode == ShadowMode::track)
    return transport::trackTransmittance<Light>(*m_medium, toLight.origin, toLight.direction,
                                                toLight.length, rng, counters, when);
  return attenuated(transport::marchOpticalDepth<Light>(
      *m_medium, toLight.origin, toLight.direction, toLight.length, m_step, when));
}

#define PHOTOSPHERE_SHADOWS(LIGHT, WHEN)                                                        \
  template LIGHT Shadows::transmittance<LIGHT, WHEN>(                                           \
      std::size_t, const Vec3f&, const Vec3f&, float, Rng&, transport::TrackingCounters&, WHEN) \
      const;
PHOTOSPHERE_FOR_EACH_RAY(PHOTOSPHERE_SHADOWS)
#undef PHOTOSPHERE_SHADOWS

std::uint64_t Shadows::memoryBytes() const {
  std::uint64_t bytes = 0;
  for (const Tabulated& grids : m_tabulated) {
    for (const LightDepth& depth : grids.depths)
      bytes += depth.memoryBytes();
    for (const Table& table : grids.tables)
      bytes += table.opticalDepth.memoryBytes();
  }
  return bytes;
}

}  // namespace photosphere::render
