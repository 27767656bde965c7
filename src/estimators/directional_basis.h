#pragma once
// Directional bases: which values of a carrier a flight adds to, and in what parts. A basis is a
// small struct; deposits are compiled once for each, so that the inner loop asks nothing.
//
// A basis B has
//   B::Along                          what is the same all along a flight, reused between flights
//   begin(flight, along)              fills it
//   at(flight, along, p, visit)       calls visit(value, weight) for light that arrives at p
//   B::kSigned                        weights may be negative
//   B::kKeepsMeans                    values are bins, which also keep their mean direction
//   B::kMost                          0, or: each flight adds to all values, at most so many
// `value` counts groups of `channels` floats within a set. For `kKeepsMeans` see LightFieldLayout.

#include <array>
#include <variant>
#include <vector>

#include "photosphere/estimators/light_field.h"
#include "photosphere/estimators/lobe.h"
#include "photosphere/sphere/spherical_harmonics.h"

namespace photosphere::estimators {

/// Histogram, all light in the bin that holds the direction.
struct NearestBin {
  static constexpr bool kSigned = false, kKeepsMeans = false;
  static constexpr int kMost = 0;
  struct Along {
    int bin = 0;
  };
  void begin(const transport::Flight& flight, Along& along) const {
    along.bin = partition.index(flight.direction);
  }
  template <class Visit>
  void at(const transport::Flight&, const Along& along, const Vec3f&, const Visit& visit) const {
    visit(along.bin, 1.0f);
  }

  sphere::Partition partition;
};

/// Histogram, light shared among bins.
struct SharedBins {
  static constexpr bool kSigned = false, kKeepsMeans = false;
  static constexpr int kMost = 0;
  struct Along {
    std::vector<sphere::BinShare> shares;
    int count = 0;
  };
  void begin(const transport::Flight& flight, Along& along) const {
    along.shares.resize(static_cast<std::size_t>(bins.maxShares()));
    along.count = bins.shares(flight.direction, along.shares.data());
  }
  template <class Visit>
  void at(const transport::Flight&, const Along& along, const Vec3f&, const Visit& visit) const {
    for (int i = 0; i < along.count; ++i) {
      const sphere::BinShare& share = along.shares[static_cast<std::size_t>(i)];
      visit(share.bin, share.weight);
    }
  }

  sphere::BinShares bins;
};

/// A histogram whose bins also keep the sum of power times direction.
template <class Bins>
struct WithMeans : Bins {
  static constexpr bool kKeepsMeans = true;
};

/// Spherical harmonics: light times each of them.
struct Harmonics {
  static constexpr bool kSigned = true, kKeepsMeans = false;
  static constexpr int kMost = sphere::SphericalHarmonics::kMaxCount;
  struct Along {
    std::array<float, sphere::SphericalHarmonics::kMaxCount> values;
  };
  void begin(const transport::Flight& flight, Along& along) const {
    harmonics.evaluate(flight.direction, along.values.data());
  }
  template <class Visit>
  void at(const transport::Flight&, const Along& along, const Vec3f&, const Visit& visit) const {
    for (int i = 0; i < harmonics.count(); ++i)
      visit(i, along.values[static_cast<std::size_t>(i)]);
  }

  sphere::SphericalHarmonics harmonics;
};

/// The view basis: one value for each phase function, times that function toward the eye, smoothed
/// by the layout's kernel over directions.
struct TowardEye {
  static constexpr bool kSigned = false, kKeepsMeans = false;
  static constexpr int kMost = 0;
  struct Along {};
  void begin(const transport::Flight&, Along&) const {}
  template <class Visit>
  void at(const transport::Flight& flight, const Along&, const Vec3f& p, const Visit& visit) const {
    const Vec3f toEye = view.toEye(p);
    for (std::size_t k = 0; k < lobes.size(); ++k)
      visit(static_cast<int>(k), lobes[k].evaluate(flight.direction, toEye));
  }

  std::vector<Lobe> lobes;  ///< by phase function
  View view;
};

using DirectionalBasis = std::variant<NearestBin, SharedBins, WithMeans<NearestBin>,
                                      WithMeans<SharedBins>, Harmonics, TowardEye>;

/// The basis that a layout asks for.
inline DirectionalBasis directionalBasis(const LightFieldLayout& layout,
                                         const transport::Medium& medium, const View& view) {
  if (layout.basis == Basis::view) {
    const sphere::SmoothingKernel kernel = layout.directionKernel();
    TowardEye toward{{}, view};
    for (const phase::PhaseFunction& phase : medium.phases())
      toward.lobes.push_back(kernel.acts() ? tabulatedLobe(phase, kernel) : Lobe{phase, nullptr});
    return toward;
  }
  if (layout.basis == Basis::sphericalHarmonics)
    return Harmonics{sphere::SphericalHarmonics(layout.order)};
  const bool nearest = layout.direction == sphere::DirectionDeposit::nearest;
  const NearestBin one{sphere::Partition(layout.rows)};
  if (layout.keepsMeans()) {
    if (nearest) return WithMeans<NearestBin>{one};
    return WithMeans<SharedBins>{{layout.binShares()}};
  }
  if (nearest) return one;
  return SharedBins{layout.binShares()};
}

}  // namespace photosphere::estimators
