#pragma once
// Upper bounds of what volumes that no ray of the frame meets do to its picture: what lets a plan
// leave them out.
//
// Notation of light_bounds.h, largest channel everywhere. D: the volumes that are left out, i one
// of them; R: all that stay, r one of them. A picture is a sum over paths of light whose vertices
// scatter (or emit) in one volume each, times what is transmitted between them. No ray of the
// camera meets D, so every path's last vertex lies in R, and the picture with D differs from that
// without by P - N, both positive, at most by the larger of the two:
//   P  paths with a vertex in D;
//   N  paths with vertices in R alone, times what D takes away of them on the way.
// Both are light that comes to R from the places of D, and LightBounds of R alone says what of it
// can reach a pixel: it leaves out extinction on the way in, and D only darkens paths within R.
//
// P. By its last vertex in D, in i: from there on the path has vertices in R alone. A line through
// i gains at most  L_i = A_i (1 - exp(-tau_i)) S_i + G_i,  S_i the light scattered there per
// scattering coefficient, G_i the glow along a line. Where R is, this adds up over directions to at
// most
//   A_i S_i min((1 - exp(-tau_i)) W_i, K_i / d_i^2) + min(G_i W_i, J_i / d_i^2),
// W_i the solid angle under which R sees i, d_i the distance of their boxes, K_i and J_i the
// integrals of extinction and emission over i. With f_i the phase function of i, F_i its maximum:
//   S_i = lamps + rest + G_i + p_i (any + rest + G_i) / (1 - p_i)
//     lamps  min(R_l, E_l f_i(>x - alpha)), summed over the lamps' reach at i; x the least angle
//            between the lamp's axis and ways from i to R. `any`: the same with x = 0
//     p_i    A_i min(1 - exp(-tau_i), 4 pi F_i (1 - exp(-D_i))): light scattered again in i
//     rest   min(1, F_i W) M: light from all other volumes, seen from i under W in sum
//   M bounds the radiance of light that was scattered or emitted, anywhere. With A, tau, F, D and G
//   of all volumes together and rho = A min(1 - exp(-tau), 4 pi F (1 - exp(-D))), it is
//     A (1 - exp(-tau)) (sum of min(R_l, F E_l / (1 - rho)) + G / (1 - rho)) + G
//   (phase functions integrate to one, and so do their mixtures: scattered light is nowhere
//   brighter than what comes in). S_i is never more than lamps + M either.
//
// N is at most the sum over i and over the ways between vertices of a path of what i takes away.
//   From a lamp to R: E_l (1 - exp(-tau_i)) with tau_i in the directions of the lamp's light, and
//   of a lamp of radiance R_l no more than R_l min((1 - exp(-tau_i)) W_i, K_i / d_i^2). Zero unless
//   the ways from i to r have a direction in common with the lamp's light at r and with that at i.
//   Between vertices of R: light of radiance M is blocked where it passes i, which takes
//   M min((1 - exp(-tau_i)) W_i, K_i / d_i^2) from R, as if i shone darkness. Zero where the box of
//   i lies apart from the box around R.

#include <vector>

#include "light_bounds.h"
#include "photosphere/scene/frame_setup.h"

namespace photosphere::scene {

/// True for a box that no ray of the frame meets, however the lens bends it; false where that
/// cannot be said: of a panorama, or of a camera that moves.
/// @param box  local space [m]
bool isUnseen(const SceneFile& scene, const FrameSetup& setup, const Box3d& box);

/// Box of all that scatters or emits, world space [scene units]; empty without smoke.
Box3d worldBoundsOf(const transport::Medium& medium, const lights::LocalSpace& space);

/// Makes the frame's medium anew without some of its volumes.
void leaveOut(const std::vector<bool>& out, FrameSetup& setup);

/// Bounds of volumes against each other. Immutable; holds on to nothing of the frame.
class UnseenVolumes {
 public:
  /// @param view  directions in which light flies that the camera sees
  UnseenVolumes(const SceneFile& scene, const FrameSetup& setup, const DirectionCone& view);

  /// By volume of the medium: that no ray of the frame meets it.
  const std::vector<bool>& unseen() const { return m_unseen; }
  /// Most that each of some volumes adds to any pixel or takes from it [W m^-2 sr^-1], where all of
  /// them are left out; 0 for the others.
  /// @param out       by volume, unseen ones alone
  /// @param lights    of the frame that this was made of
  /// @param multiple  whether light that is scattered twice or more is simulated
  std::vector<double> effects(const std::vector<bool>& out, const transport::LightList& lights,
                              bool multiple) const;

 private:
  struct Part {
    Box3d box;  // at every time [m]
    SmokeBounds smoke;
    double extinction = 0;             // K [m^2]
    double power = 0;                  // J [W/sr]
    std::vector<lights::Reach> lamps;  // at its sphere, in the order of the frame's
  };
  // What stays.
  struct Rest {
    std::vector<const Part*> parts;
    Box3d box;
    SmokeBounds smoke;
    std::vector<lights::Reach> lamps;  // at its sphere
  };

  static Part makePart(const transport::Medium& medium, const transport::MediumVolume& volume,
                       const transport::LightList& lights);
  Rest restWithout(const std::vector<bool>& out, const transport::LightList& lights) const;
  double scattered() const;
  double adds(const Part& part, const Rest& rest, const LightBounds& bounds) const;
  double takes(const Part& part, const Rest& rest, const LightBounds& bounds, bool multiple) const;
  double lightScatteredIn(const Part& part, const DirectionCone& toRest) const;

  DirectionCone m_view;
  std::vector<bool> m_unseen;
  std::vector<Part> m_parts;  // by volume; none where all are seen
  double m_scattered = 0;     // M
};

}  // namespace photosphere::scene
