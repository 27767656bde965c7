#pragma once
// Which of many lamps to take the light of.

#include <vector>

#include "photosphere/transport/medium.h"
#include "photosphere/transport/photon_tracer.h"

namespace photosphere::render {

/// Draws one of many lamps for a place in the smoke, by the power that each sends to the cell of a
/// coarse lattice around it. What a lamp gives over the probability of drawing it has the sum over
/// all lamps as its mean. Immutable; thread-safe.
class LampChoice {
 public:
  /// Lamps up to which asking every one costs less than the noise of drawing.
  static constexpr std::size_t kFew = 64;
  /// Lamps drawn for a place where there are more.
  static constexpr int kDrawn = 8;

  /// @param lamps  must outlive it
  LampChoice(const transport::Medium& medium, const std::vector<const lights::Light*>& lamps);

  struct Drawn {
    std::size_t lamp = 0;      ///< index into `lamps`
    float probability = 0.0f;  ///< 0 where no lamp shines on the cell
  };
  /// @param p  local space [m]
  /// @param u  uniform in [0, 1)
  Drawn at(const Vec3f& p, double u) const;

 private:
  std::size_t cellOf(const Vec3f& p) const;

  std::size_t m_lamps;
  Vec3f m_origin{0.0f};
  Vec3f m_inverseCell{1.0f};
  Vec3i m_dims{1};
  std::vector<float> m_cumulative;  // lamp by lamp in each cell; all 0 where none shines
};

}  // namespace photosphere::render
