#include "photosphere/transport/importance.h"

#include <algorithm>
#include <cmath>

#include "photosphere/core/fast_math.h"
#include "photosphere/core/parallel.h"
#include "photosphere/core/sampling.h"
#include "photosphere/core/sequence.h"
#include "photosphere/transport/photon_tracer.h"
#include "photosphere/transport/tracking.h"

namespace photosphere::transport {

namespace {

// Part of births that are drawn evenly, so that no light is lost that the map does not know of and
// no photon weighs more than ten.
constexpr double kEven = 0.1;
// Photons tried in each cell of a table.
constexpr int kTries = 3;

// Importance of a photon's first collision: the mean over its way of transmittance times extinction
// times importance.
double gainAlong(const Medium& medium, const ImportanceMap& map, const Vec3f& o, const Vec3f& d,
                 float length) {
  const auto step = 2.0f * static_cast<float>(medium.voxelEdge());
  const Medium::AlongRay extinction(medium, o, d);
  double sum = 0;
  float transmittance = 1.0f;
  for (volume::MajorantGrid::Walk walk(medium.majorants(), o, d, 0.0f, length); !walk.done();
       walk.advance()) {
    if (!(walk.majorant() > 0.0f)) continue;
    const float span = walk.end() - walk.begin();
    if (!(span > 0.0f)) continue;
    const int parts = std::max(1, static_cast<int>(std::ceil(span / step)));
    const float h = span / static_cast<float>(parts);
    for (int i = 0; i < parts; ++i) {
      const float t = walk.begin() + (static_cast<float>(i) + 0.5f) * h;
      const float left = transmittance * fastExp(-extinction(t) * h);
      sum += static_cast<double>((transmittance - left) * map.at(o + d * t));
      transmittance = left;
    }
    if (transmittance < 1e-3f) break;
  }
  return sum;
}

// A number in [0, 1) at a place within one of the cells that divide it, below 1 as a float too.
double within(std::size_t cell, double place) {
  return std::min((static_cast<double>(cell) + place) / PhotonGuide::kCells, 1.0 - 0x1p-24);
}

}  // namespace

ImportanceMap::ImportanceMap(const Box3d& bounds, int cells) {
  const Vec3d extent = bounds.extent();
  const double edge = std::max(maxComponent(extent) / cells, 1e-30);
  m_origin = Vec3f(bounds.min);
  m_inverseEdge = static_cast<float>(1.0 / edge);
  m_dims = glm::clamp(Vec3i(glm::ceil(extent / edge)), Vec3i(1), Vec3i(cells));
  m_values.assign(static_cast<std::size_t>(m_dims.x) * static_cast<std::size_t>(m_dims.y) *
                      static_cast<std::size_t>(m_dims.z),
                  0.0f);
}

void ImportanceMap::set(const std::vector<double>& sums) {
  std::size_t i = 0;
  for (int z = 0; z < m_dims.z; ++z)
    for (int y = 0; y < m_dims.y; ++y)
      for (int x = 0; x < m_dims.x; ++x, ++i) {
        const Vec3i c(x, y, z);
        double sum = 0, weights = 0;
        for (int n = 0; n < 27; ++n) {
          const Vec3i offset(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
          const Vec3i at = c + offset;
          if (at != glm::clamp(at, Vec3i(0), m_dims - 1)) continue;
          const double weight =
              1.0 / (1 << (std::abs(offset.x) + std::abs(offset.y) + std::abs(offset.z)));
          const auto place = (static_cast<std::size_t>(at.z) * static_cast<std::size_t>(m_dims.y) +
                              static_cast<std::size_t>(at.y)) *
                                 static_cast<std::size_t>(m_dims.x) +
                             static_cast<std::size_t>(at.x);
          sum += weight * sums[place];
          weights += weight;
        }
        m_values[i] = static_cast<float>(sum / weights);
      }
}

PhotonGuide::PhotonGuide(const Medium& medium, const LightList& lights, ImportanceMap importance)
    : m_importance(std::move(importance)) {
  const lights::BoundingSphere bounds = boundingSphere(medium);
  std::vector<double> powers;
  for (const auto& light : lights)
    powers.push_back(lights::largestPower(*light, bounds));
  if (medium.emission()) powers.push_back(medium.emission()->birthPower());
  std::vector<double> means(powers.size());
  double whole = 0, gained = 0;
  for (std::size_t source = 0; source < powers.size(); ++source) {
    std::vector<double> gains(kCells * kCells);
    if (powers[source] > 0)
      parallelFor(gains.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t cell = begin; cell < end; ++cell)
          for (int i = 0; i < kTries; ++i) {
            // The first two numbers are places within the cell.
            Vec4f u = evenPoint(cell * kTries + static_cast<std::size_t>(i));
            u.x = static_cast<float>(within(cell / kCells, static_cast<double>(u.x)));
            u.y = static_cast<float>(within(cell % kCells, static_cast<double>(u.y)));
            gains[cell] += gain(medium, lights, bounds, source, powers[source], u) / kTries;
          }
      });
    double sum = 0;
    for (const double g : gains)
      sum += g;
    means[source] = sum / static_cast<double>(gains.size());
    m_tables.push_back(tableOf(gains, means[source]));
    whole += powers[source];
    gained += powers[source] * means[source];
  }
  if (!(whole > 0) || !(gained > 0)) return;
  m_mean = gained / whole;
  for (std::size_t source = 0; source < powers.size(); ++source)
    m_sources.push_back(kEven * powers[source] / whole +
                        (1 - kEven) * powers[source] * means[source] / gained);
}

double PhotonGuide::gain(const Medium& medium, const LightList& lights,
                         const lights::BoundingSphere& bounds, std::size_t source, double usual,
                         const Vec4f& u) const {
  if (source == lights.size()) {
    const Emission::Birth birth =
        medium.emission()->birth(static_cast<double>(u.x), Vec3f(u.z, u.w, 0.5f));
    return static_cast<double>(m_importance.at(birth.origin));
  }
  const lights::Emission birth = lights[source]->emit(bounds, u);
  const double power = maxComponent(Vec3d(birth.power));
  if (!(power > 0)) return 0;
  const Segment inside =
      clipToMedium(medium, birth.origin, birth.direction, std::numeric_limits<double>::infinity());
  if (!(inside.length > 0.0f)) return 0;
  return power / usual *
         gainAlong(medium, m_importance, inside.origin, inside.direction, inside.length);
}

PhotonGuide::Table PhotonGuide::tableOf(const std::vector<double>& gains, double mean) {
  Table table;
  double total = 0;
  table.rows.push_back(0.0f);
  const double cells = kCells * kCells;
  for (int row = 0; row < kCells; ++row) {
    double sum = 0;
    std::vector<double> cumulative{0.0};
    for (int column = 0; column < kCells; ++column) {
      const double g = gains[static_cast<std::size_t>(row * kCells + column)];
      const double density = mean > 0 ? kEven + (1 - kEven) * g / mean : 1.0;
      table.density.push_back(static_cast<float>(density));
      cumulative.push_back(sum += density);
    }
    for (const double c : cumulative)
      table.columns.push_back(static_cast<float>(c / sum));
    total += sum;
    table.rows.push_back(static_cast<float>(total / cells));
  }
  for (float& row : table.rows)
    row = static_cast<float>(static_cast<double>(row) * cells / total);
  table.rows.back() = 1.0f;
  return table;
}

PhotonGuide::Drawn PhotonGuide::draw(std::size_t source, const Vec2d& u) const {
  const Table& table = m_tables[source];
  const auto invert = [](const float* cumulative, double value, int& cell) {
    const float* found = std::upper_bound(cumulative + 1, cumulative + kCells, value);
    cell = static_cast<int>(found - cumulative) - 1;
    const auto low = static_cast<double>(cumulative[cell]);
    const auto high = static_cast<double>(cumulative[cell + 1]);
    const double part = high > low ? (value - low) / (high - low) : 0.5;
    return within(static_cast<std::size_t>(cell), glm::clamp(part, 0.0, 1.0));
  };
  Drawn drawn;
  int row = 0, column = 0;
  drawn.u.x = invert(table.rows.data(), u.x, row);
  drawn.u.y = invert(table.columns.data() + row * (kCells + 1), u.y, column);
  drawn.weight = 1.0f / table.density[static_cast<std::size_t>(row * kCells + column)];
  return drawn;
}

}  // namespace photosphere::transport
