#pragma once
// How one phase function reads what a carrier holds: directions and phase fold into one colour
// (METHOD.md section 5.1).

#include <optional>
#include <vector>

#include "photosphere/estimators/light_field.h"
#include "photosphere/sphere/bin_weights.h"
#include "photosphere/sphere/spherical_harmonics.h"
#include "photosphere/sphere/zonal.h"

namespace photosphere::estimators {

/// Immutable; thread-safe. The medium must outlive it.
class PhaseReader {
 public:
  /// @param phase  index into the medium's phase functions
  PhaseReader(const LightFieldLayout& layout, const transport::Medium& medium, int phase);

  /// What all carriers seen from one direction share. Reused from one direction to the next.
  struct Toward {
    Vec3f wo{0.0f};              ///< unit propagation direction toward the eye
    std::vector<float> weights;  ///< of bins [1/sr] or harmonics [sr^-1/2]
    std::vector<float> scratch;
  };
  void turn(const Vec3f& wo, Toward& toward) const;

  /// Integral of phase times light over directions, of one set of one carrier. Not clamped: where
  /// light is peaked the smooth reconstruction, and harmonics cut at an order, can dip below zero.
  Rgb read(const float* set, const Toward& toward) const;
  /// The part of one bin.
  Rgb readBin(const float* set, int bin, const Toward& toward) const;

 private:
  Rgb channels(const float* values) const {
    return m_layout.channels == 1 ? Rgb(values[0]) : Rgb(values[0], values[1], values[2]);
  }
  float lobe(const float* set, int bin, const Vec3f& wo) const;
  void restore();
  void tabulate(const phase::PhaseFunction& function);

  LightFieldLayout m_layout;
  const transport::Medium& m_medium;
  int m_phase;
  // One of these, by layout; none for the view basis, whose values hold the phase function.
  struct Bins {
    float weight;
    sphere::BinWeights table;
  };
  std::vector<Bins> m_bins;  // by lobe of the phase function
  std::optional<sphere::SphericalHarmonics> m_harmonics;
  std::vector<float> m_moments;              // of the phase function, by harmonic
  std::optional<sphere::LobeTable> m_lobes;  // Representative::mean
  std::vector<Vec3f> m_directions;           // K restored directions
  std::vector<float> m_restored;             // share of each bin in each, [direction][bin]
};

/// Power of a bin, all channels alike: what Merge::sampled draws in proportion to.
inline float binPower(const LightFieldLayout& layout, const float* set, int bin) {
  const float* v = set + bin * layout.channels;
  return layout.channels == 1 ? v[0] : (v[0] + v[1] + v[2]) * (1.0f / 3.0f);
}

}  // namespace photosphere::estimators
