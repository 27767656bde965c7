#pragma once
// Lights: the table of models, their illumination of a point and their photons. All in local space
// [m] (ARCHITECTURE.md, Precision): world positions minus the smoke's centre, times metres per
// unit.

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "photosphere/core/hash.h"
#include "photosphere/core/param.h"
#include "photosphere/core/types.h"

namespace photosphere::lights {

/// Local space of a scene: local = (world - center) * metersPerUnit.
struct LocalSpace {
  Vec3d center{0.0};
  double metersPerUnit = 1.0;

  Vec3d localFromWorld(const Vec3d& p) const { return (p - center) * metersPerUnit; }
  Vec3d worldFromLocal(const Vec3d& p) const { return p / metersPerUnit + center; }
};

/// Bounding sphere of the smoke, local space [m]: what photons are aimed at.
struct BoundingSphere {
  Vec3d center{0.0};
  double radius = 1.0;
};

/// Light that arrives at a point from a light without extent, or from one sampled direction.
struct Illumination {
  Vec3f direction{0.0f};       ///< unit, along propagation (from the light to the point)
  float distance = kInfinity;  ///< to the light [m]; infinite for directional, environment
  Rgb irradiance{0.0f};        ///< normal irradiance [W/m^2] without extinction; for an environment
                               ///< sample: radiance over its density (radiance / pdf)
};

/// A photon at birth. Position in double: a light may be far away.
struct Emission {
  Vec3d origin{0.0};      ///< local space [m]; the light itself, or a point on the way from it
                          ///< to the smoke (disc before the sphere, end of a long way)
  Vec3f direction{0.0f};  ///< unit
  Rgb power{0.0f};        ///< [W] when one photon is emitted; divide by the count
};

/// What of a light's unattenuated light can reach a sphere at most: bounds that hold at every point
/// of it, for the largest channel. Infinite where nothing is known.
struct Reach {
  double fluence = std::numeric_limits<double>::infinity();   ///< [W m^-2], over all directions
  double radiance = std::numeric_limits<double>::infinity();  ///< [W m^-2 sr^-1], in any direction;
                                                              ///< infinite without extent
  /// The most that `Light::background` gives in any direction.
  double background = std::numeric_limits<double>::infinity();
  Vec3d axis{0.0, 0.0, 1.0};  ///< all of it travels within a cone about this unit direction
  double oneMinusCos = 2.0;   ///< of the cone's half angle; 2 = in any direction
};

/// Where a lamp stands.
struct Place {
  Vec3d center{0.0};    ///< local space [m]
  double extent = 0.0;  ///< no point of the lamp lies farther from there [m]
};

/// Pixels that are no light.
struct InvalidContent {
  std::string what;     ///< how many there are, and the first of them
  bool finite = false;  ///< all are numbers below 0, as filters of pictures leave them
};

class Light {
 public:
  virtual ~Light() = default;
  const std::string& name() const { return m_name; }
  void setName(std::string name) { m_name = std::move(name); }

  /// Power that reaches the bounding sphere when nothing is in the way [W], per channel: what
  /// photon emission draws from. Zero for a light that cannot reach it.
  virtual Rgb power(const BoundingSphere& bounds) const = 0;
  /// The same up to a factor near 1, and 0 only where no light gets: what a lamp is chosen by that
  /// is one of many, at many places [W].
  virtual Rgb roughPower(const BoundingSphere& bounds) const { return power(bounds); }
  /// What a plan may rely on: fluence 0 says that no light reaches the sphere.
  virtual Reach reach(const BoundingSphere& bounds) const {
    (void)bounds;
    return {};
  }
  /// Draws a photon that enters the bounding sphere, or starts inside it. E[power] = power(bounds);
  /// a photon of power 0 (outside the cone of a spot) need not enter. Thread-safe; same bits on
  /// every CPU.
  /// @param u  four uniform numbers in [0, 1)
  virtual Emission emit(const BoundingSphere& bounds, const Vec4f& u) const = 0;
  /// Illumination of a point. Lights without extent ignore `u`. Finite everywhere: 1/d^2 of a point
  /// or spot light stops growing at the rounding of a float position (1e-7 of the light's distance
  /// from the origin, at least 1e-9 m), and is 0 at the light itself. Thread-safe.
  virtual Illumination illuminate(const Vec3f& point, const Vec2f& u) const = 0;
  /// True for a light without extent or spread of directions: `illuminate` is exact.
  virtual bool isDelta() const = 0;
  /// True for surroundings of one radiance, which rays that leave the scene meet without noise;
  /// other lights are better sampled by `illuminate`.
  virtual bool isUniform() const { return false; }
  /// From where its light spreads, growing as 1/d^2 on the way there; none for light from far away.
  virtual std::optional<Place> place() const { return std::nullopt; }
  /// Radiance that a ray which leaves the scene in `direction` meets [W m^-2 sr^-1].
  virtual Rgb background(const Vec3f& direction) const {
    (void)direction;
    return Rgb(0.0f);
  }
  /// True when no channel differs from another.
  virtual bool isGrey() const = 0;
  /// Adds what decides its light and is not among its options: the content of files.
  virtual void addContent(Hasher& hasher) const { (void)hasher; }
  /// What its files hold that is no light and counts as 0; nothing = all is light.
  virtual std::optional<InvalidContent> invalidContent() const { return {}; }

 private:
  std::string m_name;
};

/// The largest channel of a power [W]; at least 0.
inline double largestPower(const Rgb& power) {
  return std::max(0.0, maxComponent(Vec3d(power)));
}
/// Power that reaches a sphere when nothing is in the way, of the largest channel [W]; at least 0.
inline double largestPower(const Light& light, const BoundingSphere& bounds) {
  return largestPower(light.power(bounds));
}

struct LightPlugin {
  std::string_view name;
  std::string_view help;
  std::span<const Param> params;
  std::unique_ptr<Light> (*create)(const ParamValues& values, const LocalSpace& space);
};

/// Options common to all lights: `name`.
std::span<const Param> lightParams();

/// Every light (generated).
std::span<const LightPlugin* const> lightModels();

}  // namespace photosphere::lights
