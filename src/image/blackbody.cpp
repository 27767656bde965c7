#include "photosphere/image/blackbody.h"

#include <algorithm>
#include <cmath>

namespace photosphere::image {

namespace {

// CIE 1931 2 degree colour matching functions xbar, ybar, zbar, every 5 nm from 380 to 780 nm.
constexpr double kFirst = 380.0, kStep = 5.0;
// clang-format off
const Vec3d kObserver[] = {
    {0.001368, 0.000039, 0.006450001}, {0.002236, 0.000064, 0.01054999},
    {0.004243, 0.00012, 0.02005001}, {0.00765, 0.000217, 0.03621}, {0.01431, 0.000396, 0.06785001},
    {0.02319, 0.00064, 0.1102}, {0.04351, 0.00121, 0.2074}, {0.07763, 0.00218, 0.3713},
    {0.13438, 0.004, 0.6456}, {0.21477, 0.0073, 1.03905}, {0.2839, 0.0116, 1.3856},
    {0.3285, 0.01684, 1.62296}, {0.34828, 0.023, 1.74706}, {0.34806, 0.0298, 1.7826},
    {0.3362, 0.038, 1.77211}, {0.3187, 0.048, 1.7441}, {0.2908, 0.06, 1.6692},
    {0.2511, 0.0739, 1.5281}, {0.19536, 0.09098, 1.28764}, {0.1421, 0.1126, 1.0419},
    {0.09564, 0.13902, 0.8129501}, {0.05795001, 0.1693, 0.6162}, {0.03201, 0.20802, 0.46518},
    {0.0147, 0.2586, 0.3533}, {0.0049, 0.323, 0.272}, {0.0024, 0.4073, 0.2123},
    {0.0093, 0.503, 0.1582}, {0.0291, 0.6082, 0.1117}, {0.06327, 0.71, 0.07824999},
    {0.1096, 0.7932, 0.05725001}, {0.1655, 0.862, 0.04216}, {0.2257499, 0.9148501, 0.02984},
    {0.2904, 0.954, 0.0203}, {0.3597, 0.9803, 0.0134}, {0.4334499, 0.9949501, 0.008749999},
    {0.5120501, 1.0, 0.005749999}, {0.5945, 0.995, 0.0039}, {0.6784, 0.9786, 0.002749999},
    {0.7621, 0.952, 0.0021}, {0.8425, 0.9154, 0.0018}, {0.9163, 0.87, 0.001650001},
    {0.9786, 0.8163, 0.0014}, {1.0263, 0.757, 0.0011}, {1.0567, 0.6949, 0.001},
    {1.0622, 0.631, 0.0008}, {1.0456, 0.5668, 0.0006}, {1.0026, 0.503, 0.00034},
    {0.9384, 0.4412, 0.00024}, {0.8544499, 0.381, 0.00019}, {0.7514, 0.321, 0.0001},
    {0.6424, 0.265, 0.00005}, {0.5419, 0.217, 0.00003}, {0.4479, 0.175, 0.00002},
    {0.3608, 0.1382, 0.00001}, {0.2835, 0.107, 0.0}, {0.2187, 0.0816, 0.0}, {0.1649, 0.061, 0.0},
    {0.1212, 0.04458, 0.0}, {0.0874, 0.032, 0.0}, {0.0636, 0.0232, 0.0}, {0.04677, 0.017, 0.0},
    {0.0329, 0.01192, 0.0}, {0.0227, 0.00821, 0.0}, {0.01584, 0.005723, 0.0},
    {0.01135916, 0.004102, 0.0}, {0.008110916, 0.002929, 0.0}, {0.005790346, 0.002091, 0.0},
    {0.004109457, 0.001484, 0.0}, {0.002899327, 0.001047, 0.0}, {0.00204919, 0.00074, 0.0},
    {0.001439971, 0.00052, 0.0}, {0.0009999493, 0.0003611, 0.0}, {0.0006900786, 0.0002492, 0.0},
    {0.0004760213, 0.0001719, 0.0}, {0.0003323011, 0.00012, 0.0}, {0.0002348261, 0.0000848, 0.0},
    {0.0001661505, 0.00006, 0.0}, {0.000117413, 0.0000424, 0.0}, {0.0000830753, 0.00003, 0.0},
    {0.0000587065, 0.0000212, 0.0}, {0.0000415099, 0.00001499, 0.0},
};
// clang-format on
constexpr int kCount = sizeof kObserver / sizeof kObserver[0];
constexpr double kBand = kStep * (kCount - 1) * 1e-9;  // [m]

// Planck's constants 2 h c^2 [W m^2 sr^-1] and h c / k [m K] (CODATA 2018, exact).
constexpr double kFirstRadiation = 1.191042972397188e-16;
constexpr double kSecondRadiation = 1.438776877503933e-2;

double planck(double meters, double kelvin) {
  return kFirstRadiation / (std::pow(meters, 5) * std::expm1(kSecondRadiation / (meters * kelvin)));
}

constexpr int kEntries = 8192;

}  // namespace

Vec3d blackbodyXyz(double kelvin) {
  if (!(kelvin > 0)) return Vec3d(0.0);
  Vec3d sum(0.0);
  double observer = 0;
  for (int i = 0; i < kCount; ++i) {
    const double end = i == 0 || i == kCount - 1 ? 0.5 : 1.0;
    sum += end * planck((kFirst + kStep * i) * 1e-9, kelvin) * kObserver[i];
    observer += end * kObserver[i].y;
  }
  return sum / observer * kBand;
}

Mat3d rgbFromXyz(const Chromaticities& space) {
  const auto xyz = [](const Vec2f& c) {
    const Vec2d d(c);
    return Vec3d(d.x / d.y, 1.0, (1.0 - d.x - d.y) / d.y);
  };
  // Primaries of y = 0 have no Y of their own; their x, y, z serve as well, as the white scales
  // them.
  const auto primary = [](const Vec2f& c) {
    const Vec2d d(c);
    return Vec3d(d.x, d.y, 1.0 - d.x - d.y);
  };
  const Mat3d columns(primary(space.red), primary(space.green), primary(space.blue));
  const Vec3d scale = glm::inverse(columns) * xyz(space.white);
  return glm::inverse(Mat3d(columns[0] * scale.x, columns[1] * scale.y, columns[2] * scale.z));
}

BlackbodyTable::BlackbodyTable(const Chromaticities& space, double lowest, double highest) {
  const Mat3d toRgb = rgbFromXyz(space);
  m_logLowest = std::log(lowest);
  const double range = std::max(std::log(highest) - m_logLowest, 1e-9);
  m_inverseStep = (kEntries - 1) / range;
  for (int i = 0; i < kEntries; ++i)
    m_values.push_back(toRgb * blackbodyXyz(std::exp(m_logLowest + i / m_inverseStep)));
}

Vec3d BlackbodyTable::at(double kelvin) const {
  if (!(kelvin > 0)) return Vec3d(0.0);
  const double u =
      std::clamp((std::log(kelvin) - m_logLowest) * m_inverseStep, 0.0, kEntries - 1.0);
  const auto i = std::min(static_cast<std::size_t>(u), static_cast<std::size_t>(kEntries - 2));
  return glm::mix(m_values[i], m_values[i + 1], u - static_cast<double>(i));
}

}  // namespace photosphere::image
