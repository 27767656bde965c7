#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

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
// `table` is the phase function's; used by the histogram basis alone.
Colours foldPhase(const LightField& field, const View& view, std::size_t set, int phaseIndex,
                  const sphere::BinWeights* table) {
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
  const int bins = layout.bins();
  parallelFor(colours.size(), 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<float> weights(static_cast<std::size_t>(bins));
    for (std::size_t i = begin; i < end; ++i) {
      table->weights(view.toEye(carrierPosition(field, i)), weights.data());
      const float* values = field.values.data() + i * stride + offset;
      Rgb sum(0.0f);
      for (int j = 0; j < bins; ++j)
        for (int c = 0; c < layout.channels; ++c)
          sum[c] += weights[static_cast<std::size_t>(j)] * values[j * layout.channels + c];
      // The smooth reconstruction dips below zero beside a sharp peak; light does not.
      sum = glm::max(sum, Rgb(0.0f));
      colours[i] = readColour(&sum.x, layout.channels);
    }
  });
  return colours;
}

std::optional<sphere::BinWeights> binWeights(const LightFieldLayout& layout,
                                             const phase::HenyeyGreenstein& phase) {
  if (layout.basis != Basis::histogram) return std::nullopt;
  return sphere::BinWeights(
      sphere::Partition(layout.rows),
      [&](const Vec3f& w, const Vec3f& wo) { return static_cast<double>(phase.evaluate(w, wo)); },
      phase.g(), sphere::Reconstruction::smooth);
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

// Weighted mean over the active neighbours; inactive ones leave both sum and weight.
Colours convolve(const SupportLattice& lattice, const Colours& colours,
                 const std::vector<Tap>& taps) {
  Colours out(colours.size());
  parallelFor(out.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Vec4f sum(0.0f);
      float weight = 0.0f;
      for (const Tap& tap : taps) {
        const std::int32_t n = lattice.number(lattice.voxel(i) + tap.offset);
        if (n < 0) continue;
        sum += tap.weight * colours[static_cast<std::size_t>(n)];
        weight += tap.weight;
      }
      out[i] = sum / weight;  // at least this voxel itself
    }
  });
  return out;
}

// What reading trilinearly between voxel means does to a smooth field: its mean over a voxel
// becomes this mean of the neighbours' (along an axis 1/8, 3/4, 1/8).
std::vector<Tap> readingTaps() {
  std::vector<Tap> taps;
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x)
        taps.push_back(
            {{x, y, z}, (x ? 0.125f : 0.75f) * (y ? 0.125f : 0.75f) * (z ? 0.125f : 0.75f)});
  return taps;
}

// Adds what a second blur takes away ("twicing", Stuetzle & Mittal 1979): the bias of voxel mean,
// kernel and interpolation falls from second to fourth order in their width. Fluence stays >= 0.
Colours sharpen(const Colours& once, const Colours& again) {
  Colours out(once.size());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = glm::max(Vec4f(0.0f), 2.0f * once[i] - again[i]);
  return out;
}

Colours smoothVoxels(const SupportLattice& lattice, const Colours& colours, SpatialKernel kernel,
                     double radius) {
  const std::vector<Tap> taps = kernelTaps(kernel, radius / lattice.edge());
  const bool widened = taps.size() > 1;
  const Colours once = widened ? convolve(lattice, colours, taps) : colours;
  const Colours twice = widened ? convolve(lattice, once, taps) : once;
  return sharpen(once, convolve(lattice, twice, readingTaps()));
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

// Gathers particle values at the voxels of a lattice.
class ParticleGather {
 public:
  ParticleGather(const LightField& field, const Medium& medium, const SupportLattice& lattice)
      : m_field(field),
        m_lattice(lattice),
        m_index(field.particles, std::max(field.layout.radius, 1e-12)) {
    // Particles crowd where smoke is dense; dividing by the extinction evens them out.
    float largest = 0.0f;
    for (const Vec3f& p : field.particles) {
      m_extinction.push_back(medium.extinction(p));
      largest = std::max(largest, m_extinction.back());
    }
    for (float& e : m_extinction)
      e = std::max(e, 1e-3f * largest + 1e-30f);
  }

  /// Fluence: the mean of the particles' own and the evened-out average, which err with opposite
  /// sign at the smoke's edge (METHOD.md section 5.3).
  Colours fluence(const Colours& colours) const {
    std::vector<std::uint8_t> reached(m_lattice.size(), 0);
    Colours out = gather([&](std::size_t voxel, const Vec3f& center, float radius) {
      Vec4f natural(0.0f), even(0.0f);
      float naturalWeight = 0.0f, evenWeight = 0.0f;
      m_index.forEachWithin(center, radius, [&](std::size_t p, float squared) {
        const float w = kernelWeight(m_field.layout.kernel, squared / (radius * radius));
        const float e = w / m_extinction[p];
        natural += w * colours[p];
        naturalWeight += w;
        even += e * colours[p];
        evenWeight += e;
      });
      reached[voxel] = naturalWeight > 0.0f;
      return reached[voxel] ? 0.5f * (natural / naturalWeight + even / evenWeight) : Vec4f(0.0f);
    });
    fillUnreached(m_lattice, out, reached);
    return out;
  }

  /// Collision density [W m^-3] by eq. 7a with the ball's volume 4/3 pi R^3 (the paper prints 3/4).
  Colours gatherRule(const Colours& colours) const {
    const float volume = ballVolume(m_field.layout.depositRadius);
    return gather([&](std::size_t, const Vec3f& center, float radius) {
      Vec4f sum(0.0f);
      float weight = 0.0f;
      m_index.forEachWithin(center, radius, [&](std::size_t p, float squared) {
        const float w = kernelWeight(m_field.layout.kernel, squared / (radius * radius));
        sum += w * colours[p];
        weight += w;
      });
      return weight > 0.0f ? sum / (weight * volume) : Vec4f(0.0f);
    });
  }

  /// Collision density [W m^-3] by eq. 7b.
  Colours scatterRule(const Colours& colours) const {
    const float volume = ballVolume(m_field.layout.radius);
    return gather([&](std::size_t, const Vec3f& center, float radius) {
      Vec4f sum(0.0f);
      m_index.forEachWithin(center, radius, [&](std::size_t p, float) { sum += colours[p]; });
      return sum / volume;
    });
  }

 private:
  static float ballVolume(double radius) {
    const double r = std::max(radius, 1e-12);
    return static_cast<float>(4.0 / 3.0 * kPi * r * r * r);
  }
  template <class At>
  Colours gather(const At& at) const {
    Colours out(m_lattice.size());
    const auto radius = static_cast<float>(std::max(m_field.layout.radius, 1e-12));
    parallelFor(out.size(), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        out[i] = at(i, m_lattice.center(i), radius);
    });
    return out;
  }

  const LightField& m_field;
  const SupportLattice& m_lattice;
  ParticleIndex m_index;
  std::vector<float> m_extinction;
};

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
    std::optional<ParticleGather> gather;
    if (field.layout.carrier == Carrier::particles) gather.emplace(field, medium, lattice);
    const std::size_t sets = m_unscattered ? 2 : 1;
    const auto phases = static_cast<std::size_t>(m_phases);
    m_fields.resize(sets * phases);
    for (std::size_t k = 0; k < phases; ++k) {
      const auto table = binWeights(field.layout, medium.phases()[k]);
      for (std::size_t set = 0; set < sets; ++set) {
        const Colours folded =
            foldPhase(field, view, set, static_cast<int>(k), table ? &*table : nullptr);
        m_fields[set * phases + k] = layOut(
            lattice, gather
                         ? spreadParticles(field, lattice, *gather, folded)
                         : smoothVoxels(lattice, folded, field.layout.kernel, field.layout.radius));
      }
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
  // From particles to the voxels that lookups read.
  Colours spreadParticles(const LightField& field, const SupportLattice& lattice,
                          const ParticleGather& gather, const Colours& folded) const {
    const LightFieldLayout& layout = field.layout;
    if (layout.holdsPower())
      return layout.energy == EnergyRule::gather ? gather.gatherRule(folded)
                                                 : gather.scatterRule(folded);
    const Colours once = gather.fluence(folded);
    const Field readable = layOut(lattice, once);
    Colours atParticles(field.particles.size());
    for (std::size_t i = 0; i < atParticles.size(); ++i)
      atParticles[i] = readable.sample((field.particles[i] - m_firstNode) * m_inverseEdge);
    return sharpen(once, gather.fluence(atParticles));
  }

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
