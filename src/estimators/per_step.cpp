#include "per_step.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>

#include "deposit.h"
#include "particle_gather.h"
#include "phase_reader.h"
#include "photosphere/core/parallel.h"
#include "voxel_smoothing.h"

namespace photosphere::estimators {

namespace {

using transport::Coefficients;
using transport::Medium;

// Sharpens values that were smoothed once (`values`) by what a second smoothing leaves (`again`).
// Bins may fall below zero by it: only the light of all of them together must not. Mean directions
// stay those of the first smoothing.
void sharpen(const LightFieldLayout& layout, const std::vector<float>& again,
             std::vector<float>& values) {
  const auto size = static_cast<std::size_t>(layout.setSize());
  const auto light = static_cast<std::size_t>(layout.bins() * layout.channels);
  parallelFor(values.size() / size, 256, [&](std::size_t begin, std::size_t end) {
    std::vector<float> before(static_cast<std::size_t>(layout.bins()));
    for (std::size_t i = begin; i < end; ++i) {
      float* set = values.data() + i * size;
      if (layout.keepsMeans())
        for (int j = 0; j < layout.bins(); ++j)
          before[static_cast<std::size_t>(j)] = binPower(layout, set, j);
      for (std::size_t k = 0; k < light; ++k)
        set[k] = 2.0f * set[k] - again[i * size + k];
      if (!layout.keepsMeans()) continue;
      for (int j = 0; j < layout.bins(); ++j) {
        const float was = before[static_cast<std::size_t>(j)];
        const float factor = was > 0.0f ? binPower(layout, set, j) / was : 0.0f;
        for (int axis = 0; axis < 3; ++axis)
          set[light + static_cast<std::size_t>(3 * j + axis)] *= factor;
      }
    }
  });
}

// What voxels and particles share: the medium's phase functions, read toward one eye at a time.
class PerStep : public InscatterSource {
 public:
  PerStep(const Medium& medium, LightField field)
      : m_field(std::move(field)),
        m_stride(static_cast<std::size_t>(m_field.layout.valuesPerCarrier())),
        m_setSize(static_cast<std::size_t>(m_field.layout.setSize())),
        m_sets(m_field.layout.unscattered ? 2 : 1) {
    static std::atomic<std::uint64_t> count{0};
    m_id = ++count;
    for (std::size_t k = 0; k < medium.phases().size(); ++k)
      m_readers.emplace_back(m_field.layout, medium, static_cast<int>(k));
  }
  bool carriesUnscattered() const override { return m_sets == 2; }
  double negativeShare() const override { return m_negativeShare; }

 protected:
  using Towards = std::vector<PhaseReader::Toward>;
  // By set and phase function.
  using Read = std::array<std::array<Rgb, transport::kMaxPhases>, 2>;
  // The direction toward the eye changes from ray to ray, not from step to step, and steps ask for
  // the same carriers again: each thread remembers its last.
  struct Memory {
    std::uint64_t owner = 0;
    Towards towards;  // by phase function
    struct Place {
      std::uint64_t ray = 0;
      std::size_t carrier = 0;
      Read read;
    };
    std::uint64_t ray = 0;
    std::array<Place, 128> places;
  };
  Memory& memoryOf(const Vec3f& wo) const {
    static thread_local Memory memory;
    if (memory.owner == m_id && memory.towards.front().wo == wo) return memory;
    memory.owner = m_id;
    ++memory.ray;
    memory.towards.resize(m_readers.size());
    for (std::size_t k = 0; k < m_readers.size(); ++k)
      m_readers[k].turn(wo, memory.towards[k]);
    return memory;
  }
  const Towards& toward(const Vec3f& wo) const { return memoryOf(wo).towards; }
  // What a carrier shows in the direction of the memory.
  const Read& readOf(std::size_t carrier, Memory& memory) const {
    Memory::Place& place = memory.places[carrier % memory.places.size()];
    if (place.ray == memory.ray && place.carrier == carrier) return place.read;
    place.ray = memory.ray;
    place.carrier = carrier;
    for (std::size_t s = 0; s < m_sets; ++s)
      for (std::size_t k = 0; k < m_readers.size(); ++k)
        place.read[s][k] = m_readers[k].read(set(carrier, s), memory.towards[k]);
    return place.read;
  }
  const float* set(std::size_t carrier, std::size_t set) const {
    return m_field.values.data() + carrier * m_stride + set * m_setSize;
  }
  // Adds the light of one phase function and set to the answer.
  static void add(const Rgb& light, std::size_t set, const Rgb& sigma, Inscatter& result) {
    (set == 0 ? result.multiple : result.single) += sigma * glm::max(light, Rgb(0.0f));
  }

  // How much of what is read is below zero, measured on some carriers toward eight directions.
  void measureNegative() {
    const std::size_t stride = m_field.carriers() / 2048 + 1;
    const sphere::Partition octants(1);
    double below = 0, above = 0;
    PhaseReader::Toward toward;
    for (int k = 0; k < octants.size(); ++k)
      for (const PhaseReader& reader : m_readers) {
        reader.turn(octants.center(k), toward);
        for (std::size_t i = 0; i < m_field.carriers(); i += stride)
          for (std::size_t s = 0; s < m_sets; ++s) {
            const Rgb read = reader.read(set(i, s), toward);
            above += static_cast<double>(meanComponent(glm::max(read, Rgb(0.0f))));
            below += static_cast<double>(meanComponent(glm::max(-read, Rgb(0.0f))));
          }
      }
    m_negativeShare = above > 0 ? below / above : 0.0;
  }

  LightField m_field;
  std::size_t m_stride, m_setSize, m_sets;
  std::vector<PhaseReader> m_readers;

 private:
  std::uint64_t m_id;
  double m_negativeShare = 0.0;
};

class VoxelSteps final : public PerStep {
 public:
  VoxelSteps(const Medium& medium, LightField field) : PerStep(medium, std::move(field)) {
    const transport::SupportLattice& lattice = m_field.lattice;
    m_inverseEdge = static_cast<float>(1.0 / lattice.edge());
    m_firstNode = Vec3f(lattice.origin() + 0.5 * lattice.edge());
    if (m_field.layout.smoothing == Smoothing::visible && m_field.weights)
      smoothWeightedValues();
    else
      smoothValues();
    measureNegative();
  }

  // Trilinear over the eight nearest voxel centres, inactive ones dark; where values are weighted,
  // over their weights.
  Inscatter at(const Vec3f& p, const Vec3f& wo, const Coefficients& c) const override {
    const Vec3f u = (p - m_firstNode) * m_inverseEdge;
    const Vec3f base = glm::floor(u), f = u - base;
    const Vec3i low(base);
    Memory& memory = memoryOf(wo);
    Read light{};
    float weight = 0.0f;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3i step(corner & 1, corner >> 1 & 1, corner >> 2);
      const std::int32_t voxel = m_field.lattice.number(low + step);
      if (voxel < 0) continue;
      const float w =
          (step.x ? f.x : 1 - f.x) * (step.y ? f.y : 1 - f.y) * (step.z ? f.z : 1 - f.z);
      if (!m_weights.empty()) weight += w * m_weights[static_cast<std::size_t>(voxel)];
      const Read& read = readOf(static_cast<std::size_t>(voxel), memory);
      for (std::size_t s = 0; s < m_sets; ++s)
        for (std::size_t k = 0; k < m_readers.size(); ++k)
          light[s][k] += w * read[s][k];
    }
    Inscatter result;
    if (!m_weights.empty() && !(weight > 0.0f)) return result;
    const float scale = m_weights.empty() ? 1.0f : 1.0f / weight;
    for (std::size_t s = 0; s < m_sets; ++s)
      for (std::size_t k = 0; k < m_readers.size(); ++k)
        add(light[s][k], s, c.scattering[k] * scale, result);
    return result;
  }

 private:
  // As many values at a time as a colour has, `count` at most.
  template <class Smooth>
  void forEachColour(std::size_t count, const Smooth& smooth) {
    Colours colours(m_field.lattice.size(), Vec4f(0.0f));
    for (std::size_t first = 0; first < m_stride; first += count) {
      const std::size_t n = std::min(count, m_stride - first);
      for (std::size_t i = 0; i < colours.size(); ++i)
        for (std::size_t k = 0; k < n; ++k)
          colours[i][static_cast<int>(k)] = m_field.values[i * m_stride + first + k];
      smooth(colours, first, n);
    }
  }
  void store(const Colours& colours, std::size_t first, std::size_t n, std::vector<float>& values) {
    for (std::size_t i = 0; i < colours.size(); ++i)
      for (std::size_t k = 0; k < n; ++k)
        values[i * m_stride + first + k] = colours[i][static_cast<int>(k)];
  }

  void smoothValues() {
    const LightFieldLayout& layout = m_field.layout;
    std::vector<float> again(m_field.values.size());
    forEachColour(4, [&](const Colours& colours, std::size_t first, std::size_t n) {
      const Smoothed smoothed =
          smoothVoxels(m_field.lattice, colours, layout.kernel, layout.radius);
      store(smoothed.once, first, n, m_field.values);
      store(smoothed.again, first, n, again);
    });
    sharpen(layout, again, m_field.values);
  }

  // As once for each view (Smoothing::visible): values times their weights, and the weights.
  void smoothWeightedValues() {
    const std::vector<float>& weights = *m_field.weights;
    m_weights.resize(weights.size());
    forEachColour(3, [&](Colours& colours, std::size_t first, std::size_t n) {
      for (std::size_t i = 0; i < colours.size(); ++i)
        colours[i] = Vec4f(Vec3f(colours[i]) * weights[i], 0.0f);
      const Colours smoothed = smoothWeighted(m_field.lattice, colours, weights, m_field.layout);
      store(smoothed, first, n, m_field.values);
      for (std::size_t i = 0; i < smoothed.size(); ++i)
        m_weights[i] = smoothed[i].w;
    });
  }

  Vec3f m_firstNode{0.0f};
  float m_inverseEdge = 1.0f;
  std::vector<float> m_weights;  // what values are times of; none = 1
};

class ParticleSteps final : public PerStep {
 public:
  ParticleSteps(const Medium& medium, LightField field, RandomKey key)
      : PerStep(medium, std::move(field)), m_gather(m_field, medium), m_key(key) {
    if (!m_field.layout.holdsPower()) sharpenFluence();
    if (m_field.layout.merge == Merge::sampled)
      accumulate();
    else
      measureNegative();
  }

  Inscatter at(const Vec3f& p, const Vec3f& wo, const Coefficients& c) const override {
    static thread_local std::vector<ParticleGather::Part> parts;
    const bool power = m_field.layout.holdsPower();
    Inscatter result;
    if (!m_gather.around(p, parts)) {
      if (power) return result;
      parts.assign(1, {m_gather.nearest(p), 1.0f});
    }
    const Towards& towards = toward(wo);
    // Fluence is multiplied by the sharp local coefficient; collision density already holds it
    // (errata 2: albedo, not sigma_s dx, times the density of collisions).
    const float scale = power ? 1.0f / c.extinction : 1.0f;
    const bool sampled = m_field.layout.merge == Merge::sampled;
    for (std::size_t s = 0; s < m_sets; ++s) {
      Rgb light[transport::kMaxPhases] = {};
      for (const ParticleGather::Part& part : parts) {
        const float* values = set(part.particle, s);
        if (sampled) {
          addDrawn(p, part, s, towards, light);
          continue;
        }
        for (std::size_t k = 0; k < m_readers.size(); ++k)
          light[k] += part.weight * m_readers[k].read(values, towards[k]);
      }
      for (std::size_t k = 0; k < m_readers.size(); ++k)
        add(light[k], s, c.scattering[k] * scale, result);
    }
    return result;
  }

 private:
  // Smoothing what was sharpened at the particles is sharpening what was smoothed: both are linear.
  void sharpenFluence() {
    std::vector<float> again(m_field.values.size(), 0.0f);
    parallelFor(m_field.particles.size(), 64, [&](std::size_t begin, std::size_t end) {
      std::vector<ParticleGather::Part> parts;
      for (std::size_t i = begin; i < end; ++i) {
        float* target = again.data() + i * m_stride;
        if (!m_gather.around(m_field.particles[i], parts)) parts.assign(1, {i, 1.0f});
        for (const ParticleGather::Part& part : parts) {
          const float* source = m_field.values.data() + part.particle * m_stride;
          for (std::size_t k = 0; k < m_stride; ++k)
            target[k] += part.weight * source[k];
        }
      }
    });
    sharpen(m_field.layout, again, m_field.values);
  }

  // Running sums of the bins' powers, for draws.
  void accumulate() {
    const auto bins = static_cast<std::size_t>(m_field.layout.bins());
    m_cumulative.resize(m_field.carriers() * m_sets * bins);
    float* out = m_cumulative.data();
    for (std::size_t i = 0; i < m_field.carriers(); ++i)
      for (std::size_t s = 0; s < m_sets; ++s) {
        float sum = 0.0f;
        for (std::size_t j = 0; j < bins; ++j) {
          sum += std::abs(binPower(m_field.layout, set(i, s), static_cast<int>(j)));
          *out++ = sum;
        }
      }
  }

  // One bin of a particle in place of all (figure 9), drawn in proportion to its power and divided
  // by that chance. The paper adds a count of 1 for each particle, which is right where all hold
  // equal power (errata 4).
  void addDrawn(const Vec3f& p, const ParticleGather::Part& part, std::size_t s,
                const Towards& towards, Rgb* light) const {
    const auto bins = static_cast<std::size_t>(m_field.layout.bins());
    const float* first = m_cumulative.data() + (part.particle * m_sets + s) * bins;
    const float total = first[bins - 1];
    if (!(total > 0.0f)) return;
    const std::uint64_t place =
        (static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(p.x)) << 32 |
         std::bit_cast<std::uint32_t>(p.y)) ^
        std::bit_cast<std::uint32_t>(p.z) * 0x9e3779b97f4a7c15ull;
    const std::uint32_t bits = roundingBits(m_key, place, static_cast<std::uint32_t>(part.particle),
                                            static_cast<std::uint32_t>(s));
    const float u = static_cast<float>(bits >> 8) * 0x1p-24f * total;
    const auto bin = static_cast<std::size_t>(std::upper_bound(first, first + bins - 1, u) - first);
    const float chance = first[bin] - (bin > 0 ? first[bin - 1] : 0.0f);
    if (!(chance > 0.0f)) return;
    const float weight = part.weight * total / chance;
    for (std::size_t k = 0; k < m_readers.size(); ++k)
      light[k] +=
          weight * m_readers[k].readBin(set(part.particle, s), static_cast<int>(bin), towards[k]);
  }

  ParticleGather m_gather;
  RandomKey m_key;
  std::vector<float> m_cumulative;  // [particle][set][bin]; Merge::sampled
};

}  // namespace

std::unique_ptr<InscatterSource> evaluatePerStep(const Medium& medium, LightField field,
                                                 RandomKey key) {
  if (field.layout.carrier == Carrier::particles)
    return std::make_unique<ParticleSteps>(medium, std::move(field), key);
  return std::make_unique<VoxelSteps>(medium, std::move(field));
}

}  // namespace photosphere::estimators
