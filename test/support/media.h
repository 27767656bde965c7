#pragma once
// Media with known answers, built straight from bricks.

#include <functional>

#include "photosphere/transport/medium.h"
#include "photosphere/transport/photon_tracer.h"

namespace photosphere::test {

struct MediumOptions {
  double albedo = 0.9;
  double g = 0.0;
  double extinction = 1.0;  ///< [1/m] per unit of density
};

/// A box of constant density 1 with sharp faces: `cells` multiples of 8, centred on the origin.
transport::MediumVolume boxVolume(const Vec3d& size, const Vec3i& cells,
                                  const MediumOptions& options);

/// A density sampled at the nodes of a lattice of `cells` (a multiple of 8 a side) over a cube of
/// the given edge, centred on the origin.
transport::MediumVolume sampledVolume(double edge, int cells, const MediumOptions& options,
                                      const std::function<double(const Vec3d&)>& density);

/// Emission sampled at the nodes of the lattice that `sampledVolume` has, or that `boxVolume` has
/// for a cube. @param j  [W m^-3 sr^-1]
transport::VolumeEmission sampledEmission(double edge, int cells,
                                          const std::function<Rgb(const Vec3d&)>& j);

/// Velocity sampled at the nodes of that lattice, with the field's own largest as `fastest`.
/// @param v  [m/s]
transport::VolumeMotion sampledMotion(double edge, int cells,
                                      const std::function<Vec3d(const Vec3d&)>& v);

/// Density of a fractal plume in a unit cube about the origin: a rising, widening column eaten away
/// by value noise. Largest value about 1.
double plumeDensity(const Vec3d& p);

transport::Medium makeMedium(transport::MediumVolume volume);

/// A lamp by plug-in name with options as text, at metres per unit 1 and centre 0.
std::unique_ptr<lights::Light> makeLight(
    const std::string& type, const std::vector<std::pair<std::string, std::string>>& options);

/// A point lamp beside smoke in the unit cube, whose shadows are tabulated along its rays, and one
/// within it, whose shadows are tabulated upright.
transport::LightList lampsBesideAndWithin();

}  // namespace photosphere::test
