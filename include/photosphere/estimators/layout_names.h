#pragma once
// Names of a layout's choices: the same in scene files, light caches and the headers of frames.

#include <optional>
#include <string_view>

#include "photosphere/estimators/light_field.h"

namespace photosphere::estimators {

template <class E>
struct Named {
  E value;
  std::string_view name;
};

/// Every choice of an enumeration, in `all`.
template <class E>
struct Names;

template <>
struct Names<Carrier> {
  static constexpr Named<Carrier> all[] = {{Carrier::voxels, "voxels"},
                                           {Carrier::particles, "particles"}};
};
template <>
struct Names<Basis> {
  static constexpr Named<Basis> all[] = {{Basis::histogram, "histogram"},
                                         {Basis::sphericalHarmonics, "spherical_harmonics"},
                                         {Basis::view, "view"}};
};
template <>
struct Names<Deposit> {
  static constexpr Named<Deposit> all[] = {{Deposit::trackLength, "track_length"},
                                           {Deposit::collision, "collision"}};
};
template <>
struct Names<EnergyRule> {
  static constexpr Named<EnergyRule> all[] = {{EnergyRule::gather, "gather"},
                                              {EnergyRule::scatter, "scatter"}};
};
template <>
struct Names<SpatialKernel> {
  static constexpr Named<SpatialKernel> all[] = {{SpatialKernel::epanechnikov, "epanechnikov"},
                                                 {SpatialKernel::box, "box"},
                                                 {SpatialKernel::gaussian, "gaussian"}};
};
template <>
struct Names<Smoothing> {
  static constexpr Named<Smoothing> all[] = {{Smoothing::twicing, "twicing"},
                                             {Smoothing::plain, "plain"},
                                             {Smoothing::density, "density"},
                                             {Smoothing::mean, "mean"},
                                             {Smoothing::visible, "visible"}};
};
template <>
struct Names<sphere::DirectionDeposit> {
  static constexpr Named<sphere::DirectionDeposit> all[] = {
      {sphere::DirectionDeposit::nearest, "nearest"},
      {sphere::DirectionDeposit::barycentric, "barycentric"},
      {sphere::DirectionDeposit::kernel, "kernel"}};
};
template <>
struct Names<Representative> {
  static constexpr Named<Representative> all[] = {{Representative::bin, "bin"},
                                                  {Representative::mean, "mean"}};
};
template <>
struct Names<Merge> {
  static constexpr Named<Merge> all[] = {{Merge::full, "full"}, {Merge::sampled, "sampled"}};
};
template <>
struct Names<Evaluate> {
  static constexpr Named<Evaluate> all[] = {{Evaluate::perView, "per_view"},
                                            {Evaluate::perStep, "per_step"}};
};
template <>
struct Names<sphere::AngularKernel> {
  static constexpr Named<sphere::AngularKernel> all[] = {
      {sphere::AngularKernel::none, "none"},
      {sphere::AngularKernel::epanechnikov, "epanechnikov"},
      {sphere::AngularKernel::gaussian, "gaussian"}};
};

template <class E>
constexpr std::string_view nameOf(E value) {
  for (const Named<E>& row : Names<E>::all)
    if (row.value == value) return row.name;
  return {};
}

/// @return nothing for an unknown name
template <class E>
constexpr std::optional<E> named(std::string_view name) {
  for (const Named<E>& row : Names<E>::all)
    if (row.name == name) return row.value;
  return std::nullopt;
}

}  // namespace photosphere::estimators
