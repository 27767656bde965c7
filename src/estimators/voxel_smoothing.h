#pragma once
// Smoothing of values on light voxels, and their layout for lookups.

#include <vector>

#include "photosphere/estimators/light_field.h"
#include "photosphere/volume/bricks.h"

namespace photosphere::estimators {

/// Four values a voxel: a colour, or part of a histogram.
using Colours = std::vector<Vec4f>;

/// Colours of a lattice as bricks, nodes at voxel centres; zero where no voxel is active.
volume::BrickField<Vec4f> layOut(const transport::SupportLattice& lattice, const Colours& colours);

/// A field smoothed once, and what smoothing that again and reading it between voxels would leave.
struct Smoothed {
  Colours once, again;
};
/// Weighted means over the active neighbours; inactive ones leave both sum and weight.
Smoothed smoothVoxels(const transport::SupportLattice& lattice, const Colours& colours,
                      SpatialKernel kernel, double radius);

/// Adds what a second blur takes away ("twicing", Stuetzle & Mittal 1979): the bias of voxel mean,
/// kernel and interpolation falls from second to fourth order in their width.
Colours sharpened(const Smoothed& smoothed);
/// Smooths and sharpens so, and inside the smoke leaves as much light as there was: to cut off what
/// is below zero turns noise into light. A voxel may be left with less than none, by as much as
/// there is around it; the sum over a ray hardly ever is.
Colours sharpenedVoxels(const transport::SupportLattice& lattice, const Colours& colours,
                        SpatialKernel kernel, double radius);

/// Weighted fluence and its weights, both smoothed: colour over the fourth value is fluence.
/// @param weights  VisibleWeight::mean by voxel
Colours smoothWeighted(const transport::SupportLattice& lattice, const Colours& colours,
                       const std::vector<float>& weights, const LightFieldLayout& layout);

/// Fluence of a lattice as the layout smooths it.
Colours smoothFluence(const transport::Medium& medium, const transport::SupportLattice& lattice,
                      const Colours& colours, const LightFieldLayout& layout);

/// Gives voxels that no particle reached the mean of their neighbours, ring by ring.
void fillUnreached(const transport::SupportLattice& lattice, Colours& colours,
                   std::vector<std::uint8_t>& reached);

}  // namespace photosphere::estimators
