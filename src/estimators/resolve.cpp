// Evaluation per view: one colour per carrier and phase function.

#include <memory>
#include <optional>

#include "near_eye.h"
#include "particle_gather.h"
#include "per_step.h"
#include "phase_reader.h"
#include "photosphere/core/interrupt.h"
#include "photosphere/core/parallel.h"
#include "visible_weight.h"
#include "voxel_smoothing.h"

namespace photosphere::estimators {

namespace {

using transport::Coefficients;
using transport::Medium;
using transport::SupportLattice;
using Field = volume::BrickField<Vec4f>;

Vec3f carrierPosition(const LightField& field, std::size_t i) {
  return field.layout.carrier == Carrier::voxels ? field.lattice.center(i) : field.particles[i];
}

// One bin of a set, drawn in proportion to its power, in place of all (figure 9).
Rgb readOneBin(const LightFieldLayout& layout, const PhaseReader& reader, const float* set,
               const PhaseReader::Toward& toward, float u) {
  float total = 0.0f;
  for (int j = 0; j < layout.bins(); ++j)
    total += binPower(layout, set, j);
  float sum = 0.0f;
  int chosen = -1;
  for (int j = 0; j < layout.bins() && (chosen < 0 || sum <= u * total); ++j) {
    const float power = binPower(layout, set, j);
    if (power > 0.0f) chosen = j;
    sum += power;
  }
  if (chosen < 0) return Rgb(0.0f);
  return reader.readBin(set, chosen, toward) * (total / binPower(layout, set, chosen));
}

// Light below zero and above, as read from carriers, summed in their order.
struct ReadLight {
  double below = 0, above = 0;
  void count(Colours& colours) {
    for (Vec4f& colour : colours) {
      below += static_cast<double>(colour.w);
      above += static_cast<double>(meanComponent(Rgb(colour)) + colour.w);
      colour.w = 0.0f;
    }
  }
};

// Folds directions and phase into one colour per carrier, times its weight (nullptr = 1).
Colours foldPhase(const LightField& field, const View& view, std::size_t set,
                  const PhaseReader& reader, const std::vector<float>* weights, RandomKey key) {
  const LightFieldLayout& layout = field.layout;
  const auto stride = static_cast<std::size_t>(layout.valuesPerCarrier());
  const std::size_t offset = set * static_cast<std::size_t>(layout.setSize());
  const bool sampled = layout.merge == Merge::sampled;
  Colours colours(field.carriers());
  parallelFor(colours.size(), 1024, [&](std::size_t begin, std::size_t end) {
    PhaseReader::Toward toward;
    for (std::size_t i = begin; i < end; ++i) {
      reader.turn(view.toEye(carrierPosition(field, i)), toward);
      const float* values = field.values.data() + i * stride + offset;
      Rgb colour;
      if (sampled) {
        Rng rng(key, RandomStream::merge, i);
        colour = readOneBin(layout, reader, values, toward, rng.uniform());
      } else {
        colour = reader.read(values, toward);
      }
      // Harmonics, and a histogram's smooth reconstruction, dip below zero beside a sharp peak and
      // give that light back elsewhere. Cutting it off here would make light of noise: neighbours
      // together hold enough to be positive. The fourth value notes how much there is.
      const Rgb below = sampled ? Rgb(0.0f) : glm::max(-colour, Rgb(0.0f));
      colours[i] = Vec4f(colour, meanComponent(below)) * (weights ? (*weights)[i] : 1.0f);
    }
  });
  return colours;
}

// The resolved field: one brick field per set and phase function, nodes at light-voxel centres.
class ResolvedField final : public InscatterSource {
 public:
  ResolvedField(const Medium& medium, const LightField& field, const View& view, RandomKey key)
      : m_phases(static_cast<int>(medium.phases().size())),
        m_unscattered(field.layout.unscattered),
        m_power(field.layout.holdsPower()),
        m_weighted(field.layout.smoothing == Smoothing::visible) {
    SupportLattice own;
    if (field.layout.carrier == Carrier::particles)
      own = SupportLattice(medium, field.layout.lightVoxel * medium.voxelEdge(), 1);
    const SupportLattice& lattice =
        field.layout.carrier == Carrier::particles ? own : field.lattice;
    m_inverseEdge = static_cast<float>(1.0 / lattice.edge());
    m_firstNode = Vec3f(lattice.origin() + 0.5 * lattice.edge());
    std::optional<ParticleGather> gather;
    if (field.layout.carrier == Carrier::particles) gather.emplace(field, medium);
    const std::size_t sets = m_unscattered ? 2 : 1;
    const auto phases = static_cast<std::size_t>(m_phases);
    m_fields.resize(sets * phases);
    std::shared_ptr<const std::vector<float>> weights;
    if (m_weighted)
      weights = field.weights ? field.weights : visibleWeights(medium, lattice, field.layout, view);
    for (std::size_t k = 0; k < phases; ++k) {
      const PhaseReader reader(field.layout, medium, static_cast<int>(k));
      for (std::size_t set = 0; set < sets; ++set) {
        Colours folded = foldPhase(field, view, set, reader, weights.get(), key);
        m_read.count(folded);
        if (m_weighted)
          folded = smoothWeighted(lattice, folded, *weights, field.layout);
        else if (gather)
          folded = spreadParticles(field, lattice, *gather, folded);
        else
          folded = smoothFluence(medium, lattice, folded, field.layout);
        m_fields[set * phases + k] = layOut(lattice, folded);
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
      result.multiple += sigma * fluence(static_cast<std::size_t>(k), u);
      if (m_unscattered)
        result.single += sigma * fluence(static_cast<std::size_t>(m_phases + k), u);
    }
    return result;
  }
  bool carriesUnscattered() const override { return m_unscattered; }
  double negativeShare() const override {
    return m_read.above > 0 ? m_read.below / m_read.above : 0.0;
  }

 private:
  // Times the phase function toward the eye [W m^-2 sr^-1].
  Rgb fluence(std::size_t field, const Vec3f& u) const {
    const Vec4f v = m_fields[field].sample(u);
    if (!m_weighted) return Rgb(v);
    return v.w > 0.0f ? Rgb(v) / v.w : Rgb(0.0f);
  }

  // From particles to the voxels that lookups read.
  Colours spreadParticles(const LightField& field, const SupportLattice& lattice,
                          const ParticleGather& gather, const Colours& folded) const {
    Smoothed smoothed;
    smoothed.once = gather.atVoxels(lattice, folded);
    if (field.layout.holdsPower()) return smoothed.once;
    const Field readable = layOut(lattice, smoothed.once);
    Colours atParticles(field.particles.size());
    for (std::size_t i = 0; i < atParticles.size(); ++i)
      atParticles[i] = readable.sample((field.particles[i] - m_firstNode) * m_inverseEdge);
    smoothed.again = gather.atVoxels(lattice, atParticles);
    return sharpened(smoothed);
  }

  int m_phases;
  bool m_unscattered;
  bool m_power;
  bool m_weighted;  // colour over the fourth value is fluence
  Vec3f m_firstNode{0.0f};
  float m_inverseEdge = 1.0f;
  ReadLight m_read;
  std::vector<Field> m_fields;
};

}  // namespace

std::shared_ptr<const std::vector<float>> visibleWeights(const Medium& medium,
                                                         const SupportLattice& lattice,
                                                         const LightFieldLayout& layout,
                                                         const View& view) {
  const VisibleWeight weight(medium, lattice, layout, view);
  auto weights = std::make_shared<std::vector<float>>(lattice.size());
  parallelFor(weights->size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      throwIfInterrupted();  // lines through all that is before it
      (*weights)[i] = weight.mean(i);
    }
  });
  return weights;
}

std::unique_ptr<InscatterSource> resolve(const Medium& medium, LightField field, const View& view,
                                         RandomKey key) {
  // Not of a cache that was stored without.
  if (field.layout.smoothing == Smoothing::visible && field.layout.carrier == Carrier::voxels &&
      !field.weights)
    field.weights = visibleWeights(medium, field.lattice, field.layout, view);
  if (field.layout.evaluate == Evaluate::perStep)
    return evaluatePerStep(medium, std::move(field), key);
  std::optional<LightField> near = nearField(medium, field, view);
  auto resolved = std::make_unique<ResolvedField>(medium, field, view, key);
  if (!near) return resolved;
  const double radius = field.layout.nearEye * field.layout.lightVoxel * medium.voxelEdge();
  return joinAtEye(std::move(resolved), evaluatePerStep(medium, std::move(*near), key),
                   Vec3f(view.eye), radius);
}

}  // namespace photosphere::estimators
