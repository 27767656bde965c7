#include <algorithm>
#include <cmath>
#include <memory>

#include "deposit.h"
#include "photosphere/core/error.h"
#include "photosphere/core/parallel.h"
#include "photosphere/estimators/light_field.h"
#include "photosphere/sphere/bin_weights.h"
#include "photosphere/sphere/partition.h"

namespace photosphere::estimators {

namespace {

using transport::Coefficients;
using transport::Medium;
using transport::SupportLattice;
using Field = volume::BrickField<Vec4f>;

// One colour per carrier: the integral of phase times fluence toward the eye.
using Colours = std::vector<Vec4f>;

Vec4f readColour(const float* values, int channels) {
  return channels == 1 ? Vec4f(values[0], values[0], values[0], 0.0f)
                       : Vec4f(values[0], values[1], values[2], 0.0f);
}

Vec3f carrierPosition(const LightField& field, std::size_t i) {
  return field.layout.carrier == Carrier::voxels ? field.lattice.center(i) : field.particles[i];
}

// Folds histogram and phase into one colour per carrier; the view basis holds that already.
Colours foldPhase(const LightField& field, const View& view, std::size_t set, int phaseIndex,
                  const phase::HenyeyGreenstein& phase) {
  const LightFieldLayout& layout = field.layout;
  const auto stride = static_cast<std::size_t>(layout.valuesPerCarrier());
  const std::size_t offset = set * static_cast<std::size_t>(layout.setSize());
  Colours colours(field.carriers());
  if (layout.basis == Basis::view) {
    for (std::size_t i = 0; i < colours.size(); ++i)
      colours[i] = readColour(field.values.data() + i * stride + offset +
                                  static_cast<std::size_t>(phaseIndex * layout.channels),
                              layout.channels);
    return colours;
  }
  const sphere::Partition partition(layout.rows);
  const sphere::BinWeights table(
      partition,
      [&](const Vec3f& w, const Vec3f& wo) { return static_cast<double>(phase.evaluate(w, wo)); },
      phase.g());
  const int bins = layout.bins();
  parallelFor(colours.size(), 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<float> weights(static_cast<std::size_t>(bins));
    for (std::size_t i = begin; i < end; ++i) {
      table.weights(view.toEye(carrierPosition(field, i)), weights.data());
      const float* values = field.values.data() + i * stride + offset;
      Rgb sum(0.0f);
      for (int j = 0; j < bins; ++j)
        for (int c = 0; c < layout.channels; ++c)
          sum[c] += weights[static_cast<std::size_t>(j)] * values[j * layout.channels + c];
      colours[i] = readColour(&sum.x, layout.channels);
    }
  });
  return colours;
}

// Mean extinction of each light voxel, over a few points inside it.
std::vector<float> meanExtinction(const Medium& medium, const SupportLattice& lattice,
                                  double lightVoxel) {
  std::vector<float> mean(lattice.size());
  const int n = std::clamp(static_cast<int>(std::ceil(lightVoxel)), 2, 4);
  const auto step = static_cast<float>(lattice.edge() / n);
  parallelFor(mean.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3f corner = lattice.center(i) - static_cast<float>(0.5 * lattice.edge());
      float sum = 0.0f;
      for (int z = 0; z < n; ++z)
        for (int y = 0; y < n; ++y)
          for (int x = 0; x < n; ++x)
            sum += medium.extinction(corner + (Vec3f(x, y, z) + 0.5f) * step);
      mean[i] = sum / static_cast<float>(n * n * n);
    }
  });
  return mean;
}

struct Tap {
  Vec3i offset;
  float weight;
};

std::vector<Tap> kernelTaps(SpatialKernel kernel, double radiusInVoxels) {
  std::vector<Tap> taps;
  const int reach = static_cast<int>(std::floor(radiusInVoxels));
  const double r2 = std::max(radiusInVoxels * radiusInVoxels, 1e-12);
  for (int z = -reach; z <= reach; ++z)
    for (int y = -reach; y <= reach; ++y)
      for (int x = -reach; x <= reach; ++x) {
        const double d2 = static_cast<double>(x * x + y * y + z * z);
        const float w = kernelWeight(kernel, static_cast<float>(d2 / r2));
        if (w > 0.0f) taps.push_back({{x, y, z}, w});
      }
  if (taps.empty()) taps.push_back({{0, 0, 0}, 1.0f});
  return taps;
}

// The mean of plain and extinction-weighted smoothing (METHOD.md section 5.3): each alone is off at
// the smoke's edge, with opposite sign.
Colours smoothVoxels(const SupportLattice& lattice, const Colours& colours,
                     const std::vector<float>& extinction, const std::vector<Tap>& taps) {
  if (taps.size() == 1) return colours;
  Colours out(colours.size());
  parallelFor(out.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3i& v = lattice.voxel(i);
      Vec4f plain(0.0f), weighted(0.0f);
      float plainWeight = 0.0f, weightedWeight = 0.0f;
      for (const Tap& tap : taps) {
        const std::int32_t n = lattice.number(v + tap.offset);
        if (n < 0) continue;
        const Vec4f& value = colours[static_cast<std::size_t>(n)];
        const float sigma = tap.weight * extinction[static_cast<std::size_t>(n)];
        plain += tap.weight * value;
        plainWeight += tap.weight;
        weighted += sigma * value;
        weightedWeight += sigma;
      }
      plain /= plainWeight;  // at least this voxel itself
      out[i] = weightedWeight > 0.0f ? 0.5f * (plain + weighted / weightedWeight) : plain;
    }
  });
  return out;
}

// Gives voxels that no particle reached the mean of their neighbours, ring by ring.
void fillUnreached(const SupportLattice& lattice, Colours& colours,
                   std::vector<std::uint8_t>& reached) {
  while (true) {
    std::vector<std::pair<std::size_t, Vec4f>> fresh;
    for (std::size_t i = 0; i < colours.size(); ++i) {
      if (reached[i]) continue;
      Vec4f sum(0.0f);
      float count = 0.0f;
      for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
          for (int x = -1; x <= 1; ++x) {
            const std::int32_t n = lattice.number(lattice.voxel(i) + Vec3i(x, y, z));
            if (n < 0 || !reached[static_cast<std::size_t>(n)]) continue;
            sum += colours[static_cast<std::size_t>(n)];
            count += 1.0f;
          }
      if (count > 0.0f) fresh.emplace_back(i, sum / count);
    }
    if (fresh.empty()) return;
    for (const auto& entry : fresh) {
      colours[entry.first] = entry.second;
      reached[entry.first] = 1;
    }
  }
}

// Particle values gathered at the voxels of a lattice.
Colours gatherParticles(const LightField& field, const Medium& medium,
                        const SupportLattice& lattice, const Colours& colours) {
  const LightFieldLayout& layout = field.layout;
  const double radius = std::max(layout.radius, 1e-12);
  const ParticleIndex index(field.particles, radius);
  const auto r = static_cast<float>(radius);
  std::vector<float> extinction(field.particles.size());
  float largest = 0.0f;
  for (std::size_t i = 0; i < extinction.size(); ++i) {
    extinction[i] = medium.extinction(field.particles[i]);
    largest = std::max(largest, extinction[i]);
  }
  const double deposit = std::max(layout.depositRadius, 1e-12);
  const auto depositVolume = static_cast<float>(4.0 / 3.0 * kPi * deposit * deposit * deposit);
  const auto gatherVolume = static_cast<float>(4.0 / 3.0 * kPi * radius * radius * radius);
  Colours out(lattice.size(), Vec4f(0.0f));
  std::vector<std::uint8_t> reached(lattice.size(), 0);
  parallelFor(out.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Vec4f natural(0.0f), even(0.0f), whole(0.0f);
      float naturalWeight = 0.0f, evenWeight = 0.0f;
      index.forEachWithin(lattice.center(i), r, [&](std::size_t p, float squared) {
        const float w = kernelWeight(layout.kernel, squared / (r * r));
        natural += w * colours[p];
        naturalWeight += w;
        // Particles crowd where smoke is dense; dividing by the extinction evens them out.
        const float e = w / std::max(extinction[p], 1e-3f * largest + 1e-30f);
        even += e * colours[p];
        evenWeight += e;
        whole += colours[p];
      });
      if (layout.holdsPower() && layout.energy == EnergyRule::scatter) {
        out[i] = whole / gatherVolume;  // eq. 7b
        reached[i] = 1;
      } else if (naturalWeight > 0.0f) {
        // Eq. 7a with the ball's volume 4/3 pi R^3 (the paper prints 3/4), or the fluence itself.
        out[i] = layout.holdsPower() ? natural / (naturalWeight * depositVolume)
                                     : 0.5f * (natural / naturalWeight + even / evenWeight);
        reached[i] = 1;
      }
    }
  });
  if (!layout.holdsPower()) fillUnreached(lattice, out, reached);
  return out;
}

Field layOut(const SupportLattice& lattice, const Colours& colours) {
  return Field(Vec3i(0), lattice.bricks(), lattice.activeBricks(),
               [&](const Vec3i& brick, Vec4f* nodes) {
                 for (int z = 0; z < Field::kNodes; ++z)
                   for (int y = 0; y < Field::kNodes; ++y)
                     for (int x = 0; x < Field::kNodes; ++x) {
                       const std::int32_t n = lattice.number(brick * 8 + Vec3i(x, y, z));
                       *nodes++ = n >= 0 ? colours[static_cast<std::size_t>(n)] : Vec4f(0.0f);
                     }
               });
}

// The resolved field: one brick field per set and phase function, nodes at light-voxel centres.
class ResolvedField final : public InscatterSource {
 public:
  ResolvedField(const Medium& medium, const LightField& field, const View& view)
      : m_phases(static_cast<int>(medium.phases().size())),
        m_unscattered(field.layout.unscattered),
        m_power(field.layout.holdsPower()) {
    SupportLattice own;
    if (field.layout.carrier == Carrier::particles)
      own = SupportLattice(medium, field.layout.lightVoxel * medium.voxelEdge(), 1);
    const SupportLattice& lattice =
        field.layout.carrier == Carrier::particles ? own : field.lattice;
    m_inverseEdge = static_cast<float>(1.0 / lattice.edge());
    m_firstNode = Vec3f(lattice.origin() + 0.5 * lattice.edge());
    std::vector<float> extinction;
    std::vector<Tap> taps;
    if (field.layout.carrier == Carrier::voxels) {
      extinction = meanExtinction(medium, lattice, field.layout.lightVoxel);
      taps = kernelTaps(field.layout.kernel, field.layout.radius / lattice.edge());
    }
    for (std::size_t set = 0; set < (m_unscattered ? 2u : 1u); ++set)
      for (int k = 0; k < m_phases; ++k) {
        const Colours folded =
            foldPhase(field, view, set, k, medium.phases()[static_cast<std::size_t>(k)]);
        m_fields.push_back(layOut(lattice, field.layout.carrier == Carrier::voxels
                                               ? smoothVoxels(lattice, folded, extinction, taps)
                                               : gatherParticles(field, medium, lattice, folded)));
      }
  }

  Inscatter at(const Vec3f& p, const Vec3f&, const Coefficients& c) const override {
    const Vec3f u = (p - m_firstNode) * m_inverseEdge;
    // Fluence is multiplied by the sharp local coefficient; collision density already holds it.
    const float scale = m_power ? 1.0f / c.extinction : 1.0f;
    Inscatter result;
    for (int k = 0; k < m_phases; ++k) {
      const Rgb sigma = c.scattering[static_cast<std::size_t>(k)] * scale;
      result.multiple += sigma * Rgb(m_fields[static_cast<std::size_t>(k)].sample(u));
      if (m_unscattered)
        result.single += sigma * Rgb(m_fields[static_cast<std::size_t>(m_phases + k)].sample(u));
    }
    return result;
  }
  bool carriesUnscattered() const override { return m_unscattered; }

 private:
  int m_phases;
  bool m_unscattered;
  bool m_power;
  Vec3f m_firstNode{0.0f};
  float m_inverseEdge = 1.0f;
  std::vector<Field> m_fields;
};

}  // namespace

std::unique_ptr<InscatterSource> resolve(const Medium& medium, const LightField& field,
                                         const View& view) {
  return std::make_unique<ResolvedField>(medium, field, view);
}

}  // namespace photosphere::estimators
