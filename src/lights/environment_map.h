#pragma once
// A picture of the surroundings in latitude and longitude, drawn from in proportion to its light.

#include <cstdint>
#include <string>
#include <vector>

#include "photosphere/image/image.h"
#include "photosphere/lights/light.h"

namespace photosphere::lights {

/// Pixels that are no light and count as 0; one counts once, by its worst channel.
struct InvalidPixels {
  std::uint64_t nans = 0, infinities = 0, negatives = 0;
  Vec2i first{0};        ///< column and row of the first of them, from the upper left corner
  float firstValue = 0;  ///< there

  std::uint64_t total() const { return nans + infinities + negatives; }
  /// `2 NaN, 1 infinite and 0 negative pixels, the first (nan) at (1, 2)`.
  std::string text() const;
};

/// Directions as OpenEXR's ImfEnvmap has them: +Y up, +Z in the middle of the picture, +X to its
/// left. Immutable; thread-safe; same bits on every CPU but for `radiance`.
class EnvironmentMap {
 public:
  /// @param image  R, G, B; at most 2^26 pixels. Values below 0 and not finite count as 0. The
  ///               display window is all of the sphere, black where the data window has nothing.
  /// @param scale  multiplies it
  /// @throws ConfigError where pixels add up to more than a float holds
  EnvironmentMap(const image::Image& image, const Rgb& scale);

  /// A direction toward the surroundings.
  struct Sample {
    Vec3f toward{0.0f};
    Rgb radiance{0.0f};
    float density = 0.0f;  ///< [1/sr]; 0 where the map is black
  };
  /// @param u  in [0, 1)^2
  Sample sample(const Vec2f& u) const;
  /// Bilinear between the middles of pixels. @param toward  unit
  Rgb radiance(const Vec3f& toward) const;
  /// Integral of the density's pixels' radiance over all directions [W m^-2].
  const Rgb& integral() const { return m_integral; }
  /// No more than this arrives from all directions together [W m^-2], read between pixels: the
  /// density weighs each pixel by the brightest mean channel around it.
  double mostFluence() const { return (m_grey ? 1.0 : 3.0) * m_total; }
  /// The brightest channel of a pixel [W m^-2 sr^-1].
  double mostRadiance() const { return static_cast<double>(m_brightest); }
  bool isGrey() const { return m_grey; }
  const InvalidPixels& invalid() const { return m_invalid; }
  void addContent(Hasher& hasher) const;

 private:
  void readPixels(const image::Image& image, const Rgb& scale);
  Rgb pixel(int x, int y) const;
  Rgb between(double x, double y) const;

  int m_width = 0, m_height = 0;
  std::vector<Rgb> m_pixels;
  std::vector<double> m_rows;       // cumulative, of rows
  std::vector<float> m_columns;     // cumulative, of the pixels of each row
  std::vector<double> m_latitudes;  // cosine of the angle from +Y at the upper edge of each row
  double m_total = 0;
  Rgb m_integral{0.0f};
  float m_brightest = 0.0f;
  bool m_grey = true;
  InvalidPixels m_invalid;
};

}  // namespace photosphere::lights
