// Thermal radiation as colour, against published chromaticities and Planck's law itself.

#include "photosphere/image/blackbody.h"

#include <gtest/gtest.h>

#include <cmath>

#include "photosphere/image/color.h"

namespace photosphere::test {

namespace {

using namespace image;

Vec2d chromaticity(const Vec3d& xyz) {
  return Vec2d(xyz.x, xyz.y) / (xyz.x + xyz.y + xyz.z);
}

// Of the Planckian locus (Wyszecki & Stiles 1982, table 1(3.11)) and of CIE illuminant A, which is
// a black body of 2856 K.
TEST(Blackbody, HasTheChromaticitiesOfThePlanckianLocus) {
  const struct {
    double kelvin, x, y;
  } known[] = {{1000, 0.6528, 0.3444}, {2000, 0.5267, 0.4133}, {2856, 0.44758, 0.40745},
               {4000, 0.3805, 0.3768}, {6500, 0.3135, 0.3237}, {10000, 0.2807, 0.2884}};
  for (const auto& k : known) {
    const Vec2d c = chromaticity(blackbodyXyz(k.kelvin));
    EXPECT_NEAR(c.x, k.x, 2e-4) << k.kelvin;
    EXPECT_NEAR(c.y, k.y, 2e-4) << k.kelvin;
  }
}

// Where the spectrum is nearly even over the band (its peak inside it), Y is the band's radiance
// weighted by ybar: between the smallest and largest spectral radiance times 400 nm. At 5200 K the
// spectrum peaks at 557 nm, where ybar does.
TEST(Blackbody, LuminanceIsTheBandsRadiance) {
  const auto planck = [](double nm, double kelvin) {
    const double h = 6.62607015e-34, c = 299792458.0, k = 1.380649e-23, l = nm * 1e-9;
    return 2 * h * c * c / std::pow(l, 5) / std::expm1(h * c / (l * k * kelvin));
  };
  const double peak = planck(557.27, 5200) * 400e-9;
  const double y = blackbodyXyz(5200).y;
  EXPECT_LT(y, peak);
  EXPECT_GT(y, 0.98 * peak);
  EXPECT_EQ(blackbodyXyz(0), Vec3d(0.0));
  EXPECT_EQ(blackbodyXyz(-5), Vec3d(0.0));
  EXPECT_LT(blackbodyXyz(300).y, 1e-15 * y);
}

TEST(Blackbody, WhitePointAndPrimariesBecomeRgb) {
  for (const char* name : {"ACEScg", "lin_rec709", "ACES2065-1", "lin_rec2020"}) {
    const auto space = knownChromaticities(name);
    ASSERT_TRUE(space) << name;
    const Mat3d rgb = rgbFromXyz(*space);
    const auto xyz = [](const Vec2f& c) {
      return Vec3d(Vec2d(c), 1.0 - static_cast<double>(c.x) - static_cast<double>(c.y));
    };
    const Vec3d white = rgb * (xyz(space->white) / static_cast<double>(space->white.y));
    const Vec3d red = rgb * xyz(space->red);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(white[c], 1.0, 1e-6) << name;
    EXPECT_GT(red.x, 0.0);
    EXPECT_NEAR(red.y / red.x, 0.0, 1e-6) << name;
    EXPECT_NEAR(red.z / red.x, 0.0, 1e-6) << name;
  }
  // The familiar first row of linear sRGB from XYZ.
  const Mat3d srgb = rgbFromXyz(*knownChromaticities("lin_rec709"));
  EXPECT_NEAR(srgb[0][0], 3.2406, 1e-3);
  EXPECT_NEAR(srgb[1][0], -1.5372, 1e-3);
  EXPECT_NEAR(srgb[2][0], -0.4986, 1e-3);
  EXPECT_FALSE(knownChromaticities("sRGB - Display"));
}

TEST(Blackbody, TableIsWithinOnePerTenThousand) {
  const Chromaticities space = *knownChromaticities("ACEScg");
  const BlackbodyTable table(space, 300, 8000);
  const Mat3d toRgb = rgbFromXyz(space);
  for (double kelvin = 301; kelvin < 8000; kelvin *= 1.00717) {
    const Vec3d exact = toRgb * blackbodyXyz(kelvin);
    const double bound = 1e-4 * maxComponent(glm::abs(exact));
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(table.at(kelvin)[c], exact[c], bound) << kelvin;
  }
  EXPECT_EQ(table.at(0), Vec3d(0.0));
}

}  // namespace

}  // namespace photosphere::test
