#pragma once
// Upper bounds of what lamps, glow and scattering can add to any pixel: what lets a plan leave
// them out.
//
// Notation, for the largest channel everywhere. A: largest albedo. tau: a bound of the optical
// depth of a line, tau_any of every line, tau_view of those that the camera sees. f: the largest of
// the phase functions by angle; F its maximum, N its integral (1 for one phase function), f(>x)
// what it has at most at angles of x and more. A lamp brings a fluence of at most E, of a radiance
// of at most R, in directions within alpha of its axis (lights::Reach); the light that reaches the
// eye flies within beta of another, the angle between the two is at least x + beta. Leaving out
// extinction on the way in, and with the integral of T sigma_s along a line <= A (1 - exp(-tau)):
//
//   scattered once     L1 <= A (1 - exp(-tau)) min(R, E f(>x - alpha)):
// what scatters at a point is a mixture of the phase functions, which integrates to one, so that it
// makes of radiance up to R no more than R.
//   scattered again, per scattering coefficient of the place: S1 = integral of f(w', wo) L1(w')
//   dw',
//     (a) tau_any in front: the angle between lamp and eye is at least x, so w' is at least x/2
//     away
//         from one of the two:  A (1 - exp(-tau_any)) E (f(>x/2) N_alpha + f(>x/2 - alpha) N),
//         N_alpha the integral of f widened by alpha; or, by the phase function's maximum, E F
//     (b) f in front, 4 pi times the mean over directions of 1 - exp(-tau) behind:
//         A 4 pi (1 - exp(-D)) E F f(>x/2 - alpha)
//     (c) of lamps with extent: rho R,  rho = A p as below
//   D: the mean over directions of the optical depth from a point, 1/(4 pi) integral of
//   sigma_t / r^2 dV, is largest when the smoke is rearranged to a ball that gets thinner outward
//   around it (Hardy, Littlewood & Polya 1952, theorem 378, in space): sum of sigma dr over shells.
//   Every further event multiplies S by no more than rho = A p, p = min(1 - exp(-tau_any),
//   4 pi F (1 - exp(-D))), so that all light scattered twice and more is at most
//     A (1 - exp(-tau_view)) (S1 toward the eye + S1 in any direction * rho / (1 - rho)),
//   and, of light of radiance R, at most A (1 - exp(-tau_view)) R: nowhere is it brighter than
//   where it comes from.
// Glow of radiance G along any line: seen <= G, scattered <= A (1 - exp(-tau_view)) G / (1 -
// rho).

#include <array>
#include <vector>

#include "photosphere/lights/light.h"
#include "photosphere/transport/medium.h"

namespace photosphere::scene {

/// Bound of phase functions by the angle between flight before and after.
class PhaseEnvelope {
 public:
  explicit PhaseEnvelope(const std::vector<phase::PhaseFunction>& phases);
  /// Most at this angle [rad] and all larger ones [1/sr]; of a negative angle as of 0.
  double beyond(double angle) const;
  double maximum() const { return m_beyond.front(); }
  /// Integral over all directions of the largest of the functions, at least 1.
  double norm() const { return m_norm; }
  /// The same of the function that is as large everywhere as within `angle` of there.
  double widenedNorm(double angle) const;

 private:
  static constexpr int kBins = 512;  // of the angle
  std::array<double, kBins> m_beyond{};
  double m_norm = 1.0;
};

/// Directions within an angle of an axis.
struct DirectionCone {
  Vec3d axis{0.0, 0.0, 1.0};  ///< unit
  double angle = kPi;         ///< half of the cone's opening [rad]; pi = every direction
};

/// Bounds of the optical depth of straight lines, from the majorants: a line meets each layer of
/// cells in one of their cells at least, over the layer's thickness over its direction's cosine.
class DepthBound {
 public:
  DepthBound() = default;
  explicit DepthBound(const volume::MajorantGrid& majorants);
  double any() const;
  double within(const DirectionCone& cone) const;
  /// Of both together.
  DepthBound& operator+=(const DepthBound& other) {
    m_layers += other.m_layers;
    return *this;
  }

 private:
  Vec3d m_layers{0.0};  // sum over layers across each axis
};

/// What the bounds go by.
struct SmokeBounds {
  std::vector<phase::PhaseFunction> phases;
  DepthBound depths;
  double meanDepth = 0;  ///< D above: no point sees more smoke in the mean over all directions
  double albedo = 0;     ///< A above
  double glow = 0;       ///< radiance of its emission along any line [W m^-2 sr^-1]
  lights::BoundingSphere sphere;  ///< local space [m]
};
SmokeBounds smokeBounds(const transport::Medium& medium);

/// D of one volume of a medium. @param majorants  of it alone, at every time
double largestMeanDepth(const transport::MediumVolume& volume,
                        const volume::MajorantGrid& majorants, bool moves);
/// Most that a volume emits anywhere, in any channel [W m^-3 sr^-1].
double brightestEmission(const transport::MediumVolume& volume);
/// 1 - exp(-depth).
double opacityOf(double depth);

/// What one lamp adds to any pixel at most [W m^-2 sr^-1], largest channel.
struct LampBound {
  double single = 0, multiple = 0;
  double background = 0;  ///< seen directly
  double shadow = 0;      ///< part of its light that smoke on the way takes away, 1 - T
};

/// Bounds of a frame's light. Immutable.
class LightBounds {
 public:
  /// @param view  directions in which light flies that the camera sees
  LightBounds(const SmokeBounds& smoke, const DirectionCone& view);

  LampBound lamp(const lights::Light& light) const { return of(light.reach(m_sphere)); }
  /// Of light that comes to the smoke, wherever it is from.
  LampBound of(const lights::Reach& reach) const;
  /// Of the medium's emission [W m^-2 sr^-1]: as it is seen, and what it lights.
  double glow() const { return m_glow; }
  double scatteredGlow() const;

 private:
  double scatteredAgain(const lights::Reach& reach, double alpha, double apart) const;

  PhaseEnvelope m_phase;
  DepthBound m_depths;
  DirectionCone m_view;
  lights::BoundingSphere m_sphere;
  double m_albedo;
  double m_anyOpacity;  // 1 - exp(-tau_any)
  double m_behind;      // 4 pi (1 - exp(-D))
  double m_opacity;     // A (1 - exp(-tau_view))
  double m_rho;
  double m_glow = 0;
};

}  // namespace photosphere::scene
